#include "host_sim/arms/arm_drive.hpp"

#include <cmath>

namespace moldloft::host_sim {

namespace {

double seconds(hal::Duration d) { return std::chrono::duration<double>(d).count(); }
hal::Duration from_seconds(double s) { return hal::Duration{std::llround(s * 1e9)}; }

}  // namespace

ArmDrive::ArmDrive(std::unique_ptr<Arm> arm, const Settings& settings, std::uint64_t seed)
    : arm_(std::move(arm)),
      errors_(settings.errors),
      settling_(settings.settling),
      random_(seed, Stream::arm),
      motion_(arm_->home()),
      stands_at_(-settings.settling) {  // the arm has been standing since before time began
  offset_before_ = offset_ = drawn();
}

ArmDrive::Offset ArmDrive::drawn() {
  Offset o;
  o.shift.x() = errors_.x_mm * random_.normal();
  o.shift.y() = errors_.y_mm * random_.normal();
  o.shift.z() = errors_.z_mm * random_.normal();
  o.yaw = errors_.yaw * random_.normal();
  return o;
}

std::expected<void, MotionError> ArmDrive::start(const hal::Pose& target, double speed_percent,
                                                 hal::Instant now) {
  const auto motion = plan_motion(*arm_, joints(now), target, speed_percent);
  if (!motion) return std::unexpected(motion.error());
  motion_ = *motion;
  started_ = now;
  stands_at_ = now + from_seconds(motion_.duration_s());
  offset_before_ = offset_;
  offset_ = drawn();
  return {};
}

void ArmDrive::stop(hal::Instant now) {
  if (!moving(now)) return;
  motion_.brake_at(seconds(now - started_));
  stands_at_ = started_ + from_seconds(motion_.duration_s());
}

Joints ArmDrive::joints(hal::Instant now) const noexcept { return motion_.at(seconds(now - started_)); }

hal::Pose ArmDrive::reported_pose(hal::Instant now) const {
  return read_back_pose(arm_->world_from_tip(joints(now)));
}

geometry::RigidMotion ArmDrive::true_world_from_tip(hal::Instant now) const {
  geometry::RigidMotion motion = arm_->true_world_from_tip(joints(now));
  const double s = moving(now) ? motion_.progress(seconds(now - started_)) : 1.0;
  const double yaw = (1 - s) * offset_before_.yaw + s * offset_.yaw;
  motion.linear() = Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()) * motion.linear();
  motion.translation() += (1 - s) * offset_before_.shift + s * offset_.shift;
  return motion;
}

}  // namespace moldloft::host_sim
