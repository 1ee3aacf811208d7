#include "tasks/cell/motion_guard.hpp"

#include "tasks/planning/tool_pose.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace moldloft::tasks {
namespace {

std::optional<hal::Message> outside(const char* what, double value, const Range& range) {
  if (range.contains(value)) return std::nullopt;
  return hal::Message::format(
      "target outside the workspace: {} {:.1f} mm, limit {:.1f} to {:.1f} mm: move the plate, or widen "
      "[robot.workspace] if the arm may go there",
      what, value, range.min, range.max);
}

std::optional<hal::Message> stands_outside(const char* what, double value, const Range& range,
                                           double parked_mm) {
  if (Range{range.min - parked_mm, range.max + parked_mm}.contains(value)) return std::nullopt;
  return hal::Message::format(
      "the robot says it stands at {} {:.1f} mm, [robot.workspace] ends at {:.1f} mm: bring it nearer, "
      "correct its units, or raise [robot.workspace] parked_mm",
      what, value, value < range.min ? range.min : range.max);
}

hal::Message not_finite() {
  return "the robot says it stands at no place at all (a pose that is not finite): correct its program";
}

struct Difference {
  double distance_mm = 0, turn_rad = 0;
  bool is_within(const Arrival& limits) const {
    return distance_mm <= limits.distance_mm && turn_rad <= limits.turn_rad;
  }
};

Difference difference(const hal::Pose& a, const hal::Pose& b) {
  const geometry::RigidMotion one = motion_of(a), other = motion_of(b);
  // Of two rotations that differ by the angle a, the matrices differ by 2 sqrt(2) sin(a / 2) in the Frobenius norm.
  const double sine = (one.linear() - other.linear()).norm() / (2 * std::numbers::sqrt2);
  return {.distance_mm = (one.translation() - other.translation()).norm(),
          .turn_rad = 2 * std::asin(std::min(1.0, sine))};
}

}  // namespace

std::optional<hal::Message> refuse_target(const hal::Pose& target, const hal::Pose& standing,
                                          int speed_percent, const Workspace& workspace) {
  if (!is_finite(target)) return hal::Message{"target is not finite: the pose was computed from bad data"};
  if (auto no = outside("x", target.x_mm, workspace.x_mm)) return no;
  if (auto no = outside("y", target.y_mm, workspace.y_mm)) return no;
  if (auto no = outside("z", target.z_mm, workspace.z_mm)) return no;
  if (auto no = outside("reach", std::hypot(target.x_mm, target.y_mm), workspace.reach_mm)) return no;
  const double step =
      std::hypot(target.x_mm - standing.x_mm, target.y_mm - standing.y_mm, target.z_mm - standing.z_mm);
  if (auto no = outside("step", step, Range{0, workspace.max_step_mm})) return no;
  if (speed_percent < 1 || speed_percent > workspace.max_speed_percent) {
    return hal::Message::format("speed {} % outside the limit 1 to {} %", speed_percent,
                                workspace.max_speed_percent);
  }
  return std::nullopt;
}

std::optional<hal::Message> refuse_arrival(const hal::Pose& reported, const hal::Pose& commanded,
                                           const Arrival& limits) {
  if (!is_finite(reported)) return not_finite();
  const Difference off = difference(reported, commanded);
  if (off.is_within(limits)) return std::nullopt;
  return hal::Message::format(
      "the robot says it has arrived {:.2f} mm and {:.2f} degrees off its target ([robot] arrival_mm, "
      "arrival_deg: {:.3g}, {:.3g}): look where the arm stands",
      off.distance_mm, off.turn_rad / hal::degree, limits.distance_mm, limits.turn_rad / hal::degree);
}

std::optional<hal::Message> refuse_standing(const hal::Pose& reported, const Workspace& workspace) {
  if (!is_finite(reported)) return not_finite();
  const double parked = workspace.parked_mm;
  if (auto no = stands_outside("x", reported.x_mm, workspace.x_mm, parked)) return no;
  if (auto no = stands_outside("y", reported.y_mm, workspace.y_mm, parked)) return no;
  if (auto no = stands_outside("z", reported.z_mm, workspace.z_mm, parked)) return no;
  return stands_outside("reach", std::hypot(reported.x_mm, reported.y_mm), workspace.reach_mm, parked);
}

std::optional<hal::Message> refuse_drift(const hal::Pose& reported, const hal::Pose& stood,
                                         const Arrival& limits) {
  if (!is_finite(reported)) return not_finite();
  const Difference off = difference(reported, stood);
  if (off.is_within(limits)) return std::nullopt;
  return hal::Message::format(
      "the robot says it stands {:.2f} mm and {:.2f} degrees from where it said it stopped ([robot] "
      "arrival_mm, "
      "arrival_deg): look whether it moved, or who moves it",
      off.distance_mm, off.turn_rad / hal::degree);
}

}  // namespace moldloft::tasks
