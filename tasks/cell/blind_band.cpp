#include "tasks/cell/blind_band.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>

// Eigen's small products are not marked; none of them allocates.
MOLDLOFT_CHECKED_AT_RUN_TIME

namespace moldloft::tasks {
namespace {

constexpr std::size_t most_shots = 128, most_runs = 64;
constexpr std::size_t fewest_shots = 3, fewest_runs = 8;
constexpr double inside_mm = 5;    // of the field's border
constexpr double same_y_mm = 1.5;  // within a shot, and from shot to shot
constexpr double other_line_mm = 5;
constexpr double usual_share = 0.6;  // of the shots since then

struct Cut {  // where the plate ends in one shot, if its stripes agree
  std::size_t shot = 0;
  double y_mm = 0;
  Eigen::Vector2d at{0, 0}, along{1, 0};  // the line in the world
};

std::optional<Cut> cut_of(const RunEvidence& evidence, std::size_t place, bool low, double half_mm) {
  const ShotSeen& shot = evidence.shots[place];
  const auto runs = evidence.runs_of(place);
  const std::size_t count = std::min(runs.size(), most_runs);
  if (!shot.plate_found || count < fewest_runs) return std::nullopt;
  const geometry::RigidMotion scanner_from_world = shot.world_from_scanner.inverse();
  std::array<double, most_runs> ends;
  for (std::size_t i = 0; i < count; ++i)
    ends[i] = (scanner_from_world * (low ? runs[i].first : runs[i].last)).y();
  std::sort(ends.begin(), ends.begin() + static_cast<std::ptrdiff_t>(count));
  const double middle = ends[count / 2];
  if (ends[count - 1 - count / 8] - ends[count / 8] > same_y_mm || std::abs(middle) > half_mm - inside_mm)
    return std::nullopt;
  const Eigen::Vector3d at = shot.world_from_scanner * Eigen::Vector3d{0, middle, 0};
  return Cut{.shot = place,
             .y_mm = middle,
             .at = at.head<2>(),
             .along = shot.world_from_scanner.linear().col(0).head<2>().normalized()};
}

double distance_between(const Cut& a, const Cut& b) {
  const Eigen::Vector2d off = a.at - b.at;
  return std::abs(b.along.x() * off.y() - b.along.y() * off.x());
}

std::optional<BlindBand> band_at(const RunEvidence& evidence, bool low, double half_mm) {
  std::array<Cut, most_shots> cuts;
  std::array<std::size_t, most_shots> seen_before{};  // shots with a plate, from the last to this cut
  std::size_t count = 0, seen = 0;
  for (std::size_t back = 0; back < std::min(evidence.shots.size(), most_shots); ++back) {
    const std::size_t place = evidence.shots.size() - 1 - back;
    if (!evidence.shots[place].plate_found) continue;
    ++seen;
    if (const auto cut = cut_of(evidence, place, low, half_mm))
      seen_before[count] = seen, cuts[count++] = *cut;
  }
  std::optional<BlindBand> found;
  std::size_t most = fewest_shots - 1;
  for (const Cut& one : std::span{cuts}.first(count)) {
    std::size_t agreeing = 0, first = 0;
    bool is_elsewhere = false;  // one of the lines is not this one
    for (std::size_t k = 0; k < count; ++k) {
      if (std::abs(cuts[k].y_mm - one.y_mm) > same_y_mm) continue;
      ++agreeing, first = k;
      is_elsewhere |= distance_between(cuts[k], one) > other_line_mm;
    }
    const bool is_usual =
        static_cast<double>(agreeing) >= usual_share * static_cast<double>(seen_before[first]);
    if (agreeing <= most || !is_elsewhere || !is_usual) continue;
    most = agreeing;
    found = BlindBand{.shot = cuts[first].shot, .y_mm = one.y_mm, .is_low = low};
  }
  return found;
}

}  // namespace

std::optional<BlindBand> blind_band(const RunEvidence& evidence, double field_y_mm) {
  const auto low = band_at(evidence, true, field_y_mm / 2);
  return low ? low : band_at(evidence, false, field_y_mm / 2);
}

}  // namespace moldloft::tasks
