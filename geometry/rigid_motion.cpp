#include "geometry/rigid_motion.hpp"

#include <cmath>
#include <numbers>

// Fixed-size Eigen throughout: constants that it keeps in local statics, and function pointers in its reductions, hide
// from the compiler that nothing here waits or allocates.
MOLDLOFT_GEOMETRY_CHECKED_AT_RUN_TIME

namespace moldloft::geometry {

namespace {

// Below this pitch (rad, or this far from pi) yaw and roll turn about the same axis as far as a
// pose can tell.
constexpr double gimbal_pitch = 1e-9;

}  // namespace

Eigen::Matrix3d rotation_from_zyz(const ZyzAngles& angles) {
  using Eigen::AngleAxisd, Eigen::Vector3d;
  return (AngleAxisd(angles.yaw, Vector3d::UnitZ()) * AngleAxisd(angles.pitch, Vector3d::UnitY()) *
          AngleAxisd(angles.roll, Vector3d::UnitZ()))
      .toRotationMatrix();
}

ZyzAngles zyz_from_rotation(const Eigen::Matrix3d& r) {
  // The third column is the tool axis (cos yaw sin pitch, sin yaw sin pitch, cos pitch); atan2 of its length
  // keeps full accuracy where acos of its height would lose half the digits.
  const double pitch = std::atan2(std::hypot(r(0, 2), r(1, 2)), r(2, 2));
  if (pitch < gimbal_pitch) return {0.0, pitch, wrapped_angle(std::atan2(r(1, 0), r(0, 0)))};
  if (std::numbers::pi - pitch < gimbal_pitch)
    return {0.0, pitch, wrapped_angle(std::atan2(r(1, 0), -r(0, 0)))};
  return {wrapped_angle(std::atan2(r(1, 2), r(0, 2))), pitch, wrapped_angle(std::atan2(r(2, 1), -r(2, 0)))};
}

RigidMotion turned_about_z(double angle, const Eigen::Vector3d& translation) {
  RigidMotion motion = RigidMotion::Identity();
  motion.linear() = Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  motion.translation() = translation;
  return motion;
}

double wrapped_angle(double angle) {
  const double wrapped = std::remainder(angle, 2 * std::numbers::pi);
  return wrapped <= -std::numbers::pi ? wrapped + 2 * std::numbers::pi : wrapped;
}

}  // namespace moldloft::geometry
