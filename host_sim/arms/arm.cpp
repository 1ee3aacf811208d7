#include "host_sim/arms/arm.hpp"

#include "tasks/planning/tool_pose.hpp"

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

hal::Pose read_back_pose(const geometry::RigidMotion& world_from_tip) {
  const auto rounded = [](double value, double step) { return std::round(value / step) * step; };
  constexpr double mm = 0.001, angle = 0.001 * hal::degree;
  const hal::Pose p = tasks::pose_of(world_from_tip);
  return {rounded(p.x_mm, mm),   rounded(p.y_mm, mm),     rounded(p.z_mm, mm),
          rounded(p.yaw, angle), rounded(p.pitch, angle), rounded(p.roll, angle)};
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
