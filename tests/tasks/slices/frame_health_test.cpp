#include "tasks/slices/frame_health.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <limits>
#include <random>

using namespace moldloft;
using namespace moldloft::tasks;

namespace {

// 100 stripes of 500 points over a slope, with a step of 6 mm across every stripe.
hal::Frame noisy_frame(double noise_mm, unsigned seed, double missing = 0) {
  hal::Frame frame{100, 50000};
  frame.stripe_count = 100, frame.point_count = 50000;
  std::mt19937 random{seed};
  std::normal_distribution<float> noise{0, static_cast<float>(noise_mm)};
  std::uniform_real_distribution<double> chance;
  for (std::uint32_t s = 0; s < 100; ++s) {
    frame.stripes[s] = {.index = static_cast<std::uint16_t>(s), .first = 500 * s, .count = 500};
    for (std::uint32_t i = 0; i < 500; ++i) {
      const auto at = 500 * s + i;
      frame.z[at] = 0.06f * static_cast<float>(i) + (i > 300 ? 6.0f : 0.0f) + noise(random);
      if (chance(random) < missing) frame.z[at] = std::numeric_limits<float>::quiet_NaN();
    }
  }
  return frame;
}

}  // namespace

TEST_CASE("a frame tells its own noise, on a slope and across a step") {
  for (const double noise : {0.01, 0.051, 0.3, 1.5}) {
    CAPTURE(noise);
    CHECK(health_of(noisy_frame(noise, 1)).noise_mm == doctest::Approx(noise).epsilon(0.2));
    CHECK(health_of(noisy_frame(noise, 1, 0.5)).noise_mm == doctest::Approx(noise).epsilon(0.3));
  }
}

TEST_CASE("the same exposure has the same fingerprint and no other has it") {
  const auto first = health_of(noisy_frame(0.05, 1));
  CHECK(health_of(noisy_frame(0.05, 1)).fingerprint == first.fingerprint);
  for (unsigned seed = 2; seed < 20; ++seed)
    CHECK(health_of(noisy_frame(0.05, seed)).fingerprint != first.fingerprint);
}

TEST_CASE("missing points are counted, and an empty frame has no noise") {
  CHECK(health_of(noisy_frame(0.05, 1)).missing == 0);
  const auto half = health_of(noisy_frame(0.05, 1, 0.5));
  CHECK(half.missing == doctest::Approx(0.5 * half.looked_at).epsilon(0.15));
  const auto none = health_of(noisy_frame(0.05, 1, 1));
  CHECK(none.missing == none.looked_at);
  CHECK(none.noise_mm == 0);
  CHECK(health_of(hal::Frame{}).looked_at == 0);
}

TEST_CASE("a scanner is at fault when it shows nothing or scatters three times what it promises") {
  const auto says = [](const hal::Frame& frame, std::string_view what) {
    const auto fault = scanner_fault(health_of(frame), 0.05);
    return fault && fault->view().find(what) != std::string_view::npos;
  };
  CHECK(says(noisy_frame(0.05, 1, 1), "shows no points"));
  CHECK(says(noisy_frame(0.25, 1), "scatter 0.2"));
  CHECK_FALSE(scanner_fault(health_of(noisy_frame(0.1, 1)), 0.05).has_value());
  CHECK_FALSE(scanner_fault(health_of(noisy_frame(0.05, 1, 0.9)), 0.05).has_value());
}
