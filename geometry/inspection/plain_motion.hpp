// A rigid motion as twelve plain numbers, for loops over many points: checked access to a matrix would cost
// as much as the motion.
//
// Accuracy     4 eps of the largest coordinate
// Cost         9 multiply-adds; allocates nothing
#pragma once

#include "geometry/rigid_motion.hpp"

namespace moldloft::geometry {

struct PlainMotion {
  double r[3][3], t[3];

  explicit PlainMotion(const RigidMotion& motion) {
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) r[i][j] = motion.linear()(i, j);
      t[i] = motion.translation()[i];
    }
  }
  Eigen::Vector3d operator*(const Eigen::Vector3d& p) const {
    const double x = p.x(), y = p.y(), z = p.z();
    return {r[0][0] * x + r[0][1] * y + r[0][2] * z + t[0], r[1][0] * x + r[1][1] * y + r[1][2] * z + t[1],
            r[2][0] * x + r[2][1] * y + r[2][2] * z + t[2]};
  }
};

}  // namespace moldloft::geometry
