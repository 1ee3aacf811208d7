// Between poses on the wire and rigid motions, and from where the scanner shall look to where the tip must
// go. Frames: world, tip, scanner. mm and rad. Pure.
#pragma once

#include "geometry/rigid_motion.hpp"
#include "hal/base/realtime.hpp"
#include "hal/robot/pose.hpp"
#include "tasks/machines/boundary_tracker.hpp"

namespace moldloft::tasks {

geometry::RigidMotion motion_of(const hal::Pose& world_from_tip) MOLDLOFT_NONBLOCKING;
geometry::RigidMotion scanner_motion_at(const hal::Pose& world_from_tip,
                                        const geometry::RigidMotion& tip_from_scanner) MOLDLOFT_NONBLOCKING;
Eigen::Vector3d into_scanner(const geometry::RigidMotion& world_from_scanner,
                             const Eigen::Vector3d& in_world) MOLDLOFT_NONBLOCKING;
hal::Pose pose_of(const geometry::RigidMotion& world_from_tip);

// The tip pose, tool pointing straight down, that brings the centre of the field of view to `place.centre` with the
// scanner turned to `place.head_yaw`. A mount that is tilted by a little leaves the scanner tilted by as much: a SCARA
// cannot take it out.
hal::Pose tip_pose_for(const ShotPlace& place,
                       const geometry::RigidMotion& tip_from_scanner) MOLDLOFT_NONBLOCKING;

}  // namespace moldloft::tasks
