// Rigid motions, named to_from: p_world = world_from_scanner * p_scanner, so that products read through.
//
// Rotations in V+'s ZYZ' Euler angles: R = Rz(yaw) Ry(pitch) Rz(roll) (V+ Language User's Guide,
// "Transformations"). The thesis's equation (5.1) is the special case of a tool that points straight down and
// turns about joint 4 only. Lengths mm, angles rad. No allocation, no failure.
#pragma once

#include "geometry/nonblocking.hpp"

#include <Eigen/Geometry>

namespace moldloft::geometry {

using RigidMotion = Eigen::Isometry3d;

struct ZyzAngles {
  double yaw = 0, pitch = 0, roll = 0;
};

Eigen::Matrix3d rotation_from_zyz(const ZyzAngles&) MOLDLOFT_GEOMETRY_NONBLOCKING;

// The inverse. Yaw lies in (-pi, pi], pitch in [0, pi]. Where pitch is 0 or pi within 1e-9 rad only yaw -+
// roll is determined: yaw is then 0 and roll carries the turn, which is what a SCARA's joint 4 does.
ZyzAngles zyz_from_rotation(const Eigen::Matrix3d&);

// A turn by `angle` about world z, then a shift.
RigidMotion turned_about_z(double angle, const Eigen::Vector3d& translation);

// The smallest angle congruent to `angle` modulo 2 pi: in (-pi, pi].
double wrapped_angle(double angle) MOLDLOFT_GEOMETRY_NONBLOCKING;

}  // namespace moldloft::geometry
