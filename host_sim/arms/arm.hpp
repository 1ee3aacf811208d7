// What the simulation asks of a robot arm. It has four joints, and a tip whose z axis points straight down.
// Poses are as on the robot's wire (tip in world, V+'s ZYZ' angles, pitch 180 degrees).
//
// A new make of arm is one more of these; what moves it (arm_drive.hpp) knows only this.
//
// Units        mm, rad
// Thread       one thread
// Allocation   at construction only
// Failure      std::expected with one line that names joint and limit
#pragma once

#include "geometry/rigid_motion.hpp"
#include "hal/base/fixed_text.hpp"
#include "hal/robot/pose.hpp"
#include "host_sim/arms/joint_motion.hpp"

#include <expected>
#include <memory>
#include <string_view>

namespace moldloft::host_sim {

struct MotionError {
  hal::Message text;
};

class Arm {
 public:
  virtual ~Arm() = default;

  virtual std::string_view name() const = 0;
  virtual const JointLimits& limits() const = 0;
  virtual Joints home() const = 0;

  // The joints that bring the tip there, turned the shortest way from where the arm stands.
  virtual std::expected<Joints, MotionError> joints_for(const hal::Pose& tip,
                                                        const Joints& standing_at) const = 0;

  // Where the tip is if the arm were as its controller believes, and where it truly is.
  virtual geometry::RigidMotion world_from_tip(const Joints&) const = 0;
  virtual geometry::RigidMotion true_world_from_tip(const Joints&) const = 0;
};

// The motion from joints to pose, or why there is none.
std::expected<JointMotion, MotionError> plan_motion(const Arm&, const Joints& from, const hal::Pose& to,
                                                    double speed_percent);

// Where the tip is, as the controller reads it back: tasks::pose_of (a tool straight down has yaw 0, pitch 180
// degrees, its turn in roll), rounded to the encoders' and the wire's 0.001 mm and 0.001 degree.
hal::Pose read_back_pose(const geometry::RigidMotion& world_from_tip);

// The turn of a tip that points straight down about world z: its x axis in plan. Fails for any other tip.
std::expected<double, MotionError> heading_of(const hal::Pose&);

// The first joint that is outside its limits, as an error; nothing when all are inside.
std::expected<void, MotionError> check_limits(const JointLimits&, const Joints&);

}  // namespace moldloft::host_sim
