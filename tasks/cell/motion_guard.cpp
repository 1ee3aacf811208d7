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
  const geometry::RigidMotion is = motion_of(reported), was_meant = motion_of(commanded);
  const double distance = (is.translation() - was_meant.translation()).norm();
  // Of two rotations that differ by the angle a, the matrices differ by 2 sqrt(2) sin(a / 2) in the Frobenius norm.
  const double sine = (is.linear() - was_meant.linear()).norm() / (2 * std::numbers::sqrt2);
  const double turn = 2 * std::asin(std::min(1.0, sine));
  if (distance <= limits.distance_mm && turn <= limits.turn_rad) return std::nullopt;
  return hal::Message::format(
      "the robot says it has arrived {:.1f} mm and {:.1f} degrees off its target ([robot] arrival_mm, "
      "arrival_deg: {:.3g}, {:.3g}): look where the arm stands",
      distance, turn / hal::degree, limits.distance_mm, limits.turn_rad / hal::degree);
}

}  // namespace moldloft::tasks
