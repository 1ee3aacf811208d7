// An arm in motion: where it stands, where it is going, how long it takes, and how far its true place is from
// the one that it believes.
//
// Motion is joint-interpolated with a trapezoid of speed; after it the arm settles. At each stop errors are
// drawn anew (repeatability); on the way they pass over from the old to the new. What the controller of the
// arm reads back is its encoders' pose: the errors are not in it.
//
// Thread       one thread
// Allocation   none after construction
// Failure      start() refuses what the arm cannot do, and then nothing moves
#pragma once

#include "hal/base/clock.hpp"
#include "host_sim/arms/arm.hpp"
#include "host_sim/base/random.hpp"

namespace moldloft::host_sim {

struct ArmErrors {  // one sigma of each stop: 0.076 mm claimed in x-y is two sigma (thesis, chapter 4)
  double x_mm = 0.038, y_mm = 0.038, z_mm = 0.013, yaw = 0.01 * hal::degree;
};

class ArmDrive {
 public:
  struct Settings {
    ArmErrors errors;
    hal::Duration settling = std::chrono::milliseconds{80};
  };

  ArmDrive(std::unique_ptr<Arm>, const Settings&, std::uint64_t seed);

  std::expected<void, MotionError> start(const hal::Pose& target, double speed_percent, hal::Instant now);
  void stop(hal::Instant now);  // brakes at once

  bool moving(hal::Instant now) const noexcept { return now < stands_at_; }  // the joints turn
  hal::Instant stands_at() const noexcept { return stands_at_; }
  hal::Instant settled_at() const noexcept { return stands_at_ + settling_; }

  hal::Pose reported_pose(hal::Instant now) const;
  geometry::RigidMotion true_world_from_tip(hal::Instant now) const;
  Joints joints(hal::Instant now) const noexcept;
  const Arm& arm() const noexcept { return *arm_; }

 private:
  struct Offset {
    Eigen::Vector3d shift = Eigen::Vector3d::Zero();
    double yaw = 0;
  };
  Offset drawn();

  std::unique_ptr<Arm> arm_;
  ArmErrors errors_;
  hal::Duration settling_;
  Random random_;
  JointMotion motion_;
  hal::Instant started_{0}, stands_at_{0};
  Offset offset_before_, offset_;
};

}  // namespace moldloft::host_sim
