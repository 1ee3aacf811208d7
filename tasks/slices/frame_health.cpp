#include "tasks/slices/frame_health.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>

namespace moldloft::tasks {
namespace {

constexpr std::size_t most_looked_at = 500;
constexpr std::size_t few_differences = 50;  // before their median counts

// A second difference of three heights has the variance of six; half of a normal variable lies within 0.6745 sigma.
const double sigma_of_median = 1 / (0.6745 * std::sqrt(6.0));

constexpr double blind_share = 0.98;  // of points missing
constexpr double useless_noise = 3;   // times what is promised

}  // namespace

FrameHealth health_of(const hal::Frame& frame) {
  FrameHealth health;
  std::array<float, most_looked_at> differences;
  std::size_t count = 0;
  const std::size_t stride = std::max<std::size_t>(frame.point_count / most_looked_at, 1);
  std::size_t next = stride / 2;
  for (const auto& line : frame.lines()) {
    for (; next < std::size_t{line.first} + line.count && health.looked_at < static_cast<int>(most_looked_at);
         next += stride) {
      ++health.looked_at;
      const float z = frame.z[next];
      if (!std::isfinite(z)) {
        ++health.missing;
        continue;
      }
      health.fingerprint = std::rotl(health.fingerprint, 7) ^ std::bit_cast<std::uint32_t>(z);
      if (next == line.first || next + 1 >= std::size_t{line.first} + line.count) continue;
      const float second = frame.z[next - 1] - 2 * z + frame.z[next + 1];
      if (std::isfinite(second)) differences[count++] = std::abs(second);
    }
  }
  if (count < few_differences) return health;
  const auto middle = differences.begin() + static_cast<std::ptrdiff_t>(count / 2);
  std::nth_element(differences.begin(), middle, differences.begin() + static_cast<std::ptrdiff_t>(count));
  health.noise_mm = sigma_of_median * *middle;
  return health;
}

bool is_blind(const FrameHealth& health) { return health.missing > blind_share * health.looked_at; }

std::optional<hal::Message> scanner_fault(const FrameHealth& health, double promised_noise_mm) {
  if (is_blind(health))
    return hal::Message::format(
        "the scanner shows no points: look at laser, shutter and window, and whether anything lies within "
        "its depth "
        "range");
  if (health.noise_mm > useless_noise * promised_noise_mm)
    return hal::Message::format(
        "the scanner's points scatter {:.2g} mm, [scanner] noise_mm promises {:g}: clean its window, look at "
        "the plate's "
        "shine, or correct the key",
        health.noise_mm, promised_noise_mm);
  return std::nullopt;
}

}  // namespace moldloft::tasks
