#include "tasks/planning/tool_pose.hpp"

#include <cmath>
#include <numbers>

// Fixed-size Eigen throughout: constants that it keeps in local statics, and function pointers in its reductions, hide
// from the compiler that nothing here waits or allocates.
MOLDLOFT_CHECKED_AT_RUN_TIME

namespace moldloft::tasks {

using geometry::RigidMotion;

RigidMotion motion_of(const hal::Pose& p) {
  RigidMotion motion = RigidMotion::Identity();
  motion.linear() = geometry::rotation_from_zyz({p.yaw, p.pitch, p.roll});
  motion.translation() << p.x_mm, p.y_mm, p.z_mm;
  return motion;
}

RigidMotion scanner_motion_at(const hal::Pose& world_from_tip, const RigidMotion& tip_from_scanner) {
  return motion_of(world_from_tip) * tip_from_scanner;
}

Eigen::Vector3d into_scanner(const RigidMotion& world_from_scanner, const Eigen::Vector3d& in_world) {
  return world_from_scanner.inverse() * in_world;
}

hal::Pose pose_of(const RigidMotion& motion) {
  const auto angles = geometry::zyz_from_rotation(motion.linear());
  const Eigen::Vector3d t = motion.translation();
  return {.x_mm = t.x(),
          .y_mm = t.y(),
          .z_mm = t.z(),
          .yaw = angles.yaw,
          .pitch = angles.pitch,
          .roll = angles.roll};
}

hal::Pose tip_pose_for(const ShotPlace& place, const RigidMotion& tip_from_scanner) {
  // With the tool straight down, roll r turns the scanner by -r: measure where its x axis points at roll 0, then turn.
  const auto down = [](double roll) { return geometry::rotation_from_zyz({0, std::numbers::pi, roll}); };
  const Eigen::Vector3d axis = down(0) * tip_from_scanner.linear().col(0);
  const double yaw_at_zero = std::atan2(axis.y(), axis.x());
  const double roll = geometry::wrapped_angle(yaw_at_zero - place.head_yaw);
  const Eigen::Vector3d tip = place.centre - down(roll) * tip_from_scanner.translation();
  return {
      .x_mm = tip.x(), .y_mm = tip.y(), .z_mm = tip.z(), .yaw = 0, .pitch = std::numbers::pi, .roll = roll};
}

}  // namespace moldloft::tasks
