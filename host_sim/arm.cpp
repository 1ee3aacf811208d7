#include "host_sim/arm.hpp"

#include <cmath>
#include <numbers>

namespace moldloft::host_sim {

std::expected<JointMotion, MotionError> plan_motion(const Arm& arm, const Joints& from, const hal::Pose& to,
                                                    double speed_percent) {
  if (!hal::is_finite(to)) {
    return std::unexpected(MotionError{"the target is not a number"});
  }
  const auto joints = arm.joints_for(to, from);
  if (!joints) return std::unexpected(joints.error());
  return JointMotion(from, *joints, arm.limits(), speed_percent / 100.0);
}

geometry::RigidMotion motion_of(const hal::Pose& pose) {
  geometry::RigidMotion motion = geometry::RigidMotion::Identity();
  motion.linear() = geometry::rotation_from_zyz({pose.yaw, pose.pitch, pose.roll});
  motion.translation() = Eigen::Vector3d{pose.x_mm, pose.y_mm, pose.z_mm};
  return motion;
}

hal::Pose pose_of(const geometry::RigidMotion& motion) {
  const auto rounded = [](double value, double step) { return std::round(value / step) * step; };
  const auto angles = geometry::zyz_from_rotation(motion.linear());
  const Eigen::Vector3d p = motion.translation();
  constexpr double mm = 0.001, angle = 0.001 * hal::degree;
  return {rounded(p.x(), mm),         rounded(p.y(), mm),           rounded(p.z(), mm),
          rounded(angles.yaw, angle), rounded(angles.pitch, angle), rounded(angles.roll, angle)};
}

std::expected<double, MotionError> heading_of(const hal::Pose& pose) {
  constexpr double down = 1e-4;  // rad; the wire's step of 0.001 degree is a fifth of it
  const double pitch = geometry::wrapped_angle(pose.pitch);
  if (std::abs(std::abs(pitch) - std::numbers::pi) > down) {
    return std::unexpected(
        MotionError{hal::Message::format("the tip must point straight down: pitch is {:.3f} degrees, "
                                         "the arm can only 180",
                                         pose.pitch / hal::degree)});
  }
  // Rz(yaw) Ry(pi) Rz(roll) = Rz(yaw - roll) Ry(pi), whose x axis points to yaw - roll + pi.
  return geometry::wrapped_angle(pose.yaw - pose.roll + std::numbers::pi);
}

std::expected<void, MotionError> check_limits(const JointLimits& limits, const Joints& joints) {
  constexpr double slack = 1e-9;
  for (std::size_t i = 0; i < joint_count; ++i) {
    if (joints[i] >= limits[i].low - slack && joints[i] <= limits[i].high + slack) continue;
    const bool linear = limits[i].name[0] == 'x' || limits[i].name[0] == 'y' || limits[i].name[0] == 'z';
    const double unit = linear ? 1.0 : hal::degree;
    return std::unexpected(MotionError{hal::Message::format(
        "{} would stand at {:.1f} {}, its limits are {:.1f} and {:.1f}", limits[i].name, joints[i] / unit,
        linear ? "mm" : "degrees", limits[i].low / unit, limits[i].high / unit)});
  }
  return {};
}

}  // namespace moldloft::host_sim
