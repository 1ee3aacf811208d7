#include "tasks/scheduler/clock_drift.hpp"

#include <doctest/doctest.h>

#include <random>

using namespace moldloft::tasks;
using namespace std::chrono_literals;
using moldloft::hal::Instant;

TEST_CASE("a clock that gains 20 parts in a million is found to gain them, whatever it began from") {
  for (const std::uint64_t begun :
       {std::uint64_t{0}, std::uint64_t{1} << 60, ~std::uint64_t{0} - 5'000'000'000}) {
    ClockDrift drift;
    for (int second = 0; second < 10; ++second)  // the last one's clock goes across its wrap
      drift.add(Instant{100h + std::chrono::seconds{second}},
                begun + static_cast<std::uint64_t>(second) * 1'000'020'000);
    const auto estimate = drift.estimate();
    REQUIRE(estimate.has_value());
    CHECK(estimate->ppm == doctest::Approx(20).epsilon(1e-9));
    CHECK(estimate->scatter_us == doctest::Approx(0).epsilon(1e-3));
    CHECK(estimate->pairs == 10);
  }
}

TEST_CASE("scatter of the reports widens the estimate as far as it spoils it") {
  std::mt19937 random{7};
  std::normal_distribution<double> late_us{500, 300};
  int within = 0;
  for (int trial = 0; trial < 300; ++trial) {
    ClockDrift drift;
    for (int shot = 0; shot < 32; ++shot) {
      const double sensor_s = 0.5 * shot;
      const double ours_s = sensor_s / (1 + 40e-6) + late_us(random) * 1e-6;
      drift.add(Instant{static_cast<std::int64_t>(ours_s * 1e9)}, static_cast<std::uint64_t>(sensor_s * 1e9));
    }
    const auto estimate = drift.estimate();
    REQUIRE(estimate.has_value());
    // 300 us about a line over 32 points of a 15.5 s stretch: 300 / sqrt(sum of (t - mean)^2) = 11.5 ppm.
    CHECK(estimate->sigma_ppm == doctest::Approx(11.5).epsilon(0.45));
    within += std::abs(estimate->ppm - 40) <= 2 * estimate->sigma_ppm;
  }
  CHECK(within >= 273);  // 95 % of 300 less three standard deviations
  CHECK(within <= 296);
}

TEST_CASE("two readings, or readings of one moment, are no estimate") {
  ClockDrift drift;
  CHECK_FALSE(drift.estimate());
  drift.add(1s, 1);
  drift.add(2s, 2);
  CHECK_FALSE(drift.estimate());
  drift.reset();
  for (int i = 0; i < 5; ++i) drift.add(1s, 1);
  CHECK_FALSE(drift.estimate());
}

TEST_CASE("a sensor's clock that goes back, stands or jumps anywhere spoils the estimate and nothing else") {
  std::mt19937_64 random{3};
  for (int trial = 0; trial < 100; ++trial) {
    ClockDrift drift;
    for (int second = 0; second < 10; ++second) drift.add(Instant{std::chrono::hours{second}}, random());
    CHECK(drift.estimate().has_value());  // under the sanitizer: no overflow
  }
  ClockDrift back;
  for (int second = 0; second < 10; ++second)
    back.add(Instant{std::chrono::seconds{second}},
             1'000'000'000'000u - static_cast<std::uint64_t>(second) * 1'000'000'000);
  CHECK(back.estimate()->ppm == doctest::Approx(-2e6));
}
