// The plan map X(u, v) = (x, y): the bilinearly blended Coons patch of the outline's four sides (thesis
// eq. 2.65), and its inverse. The plate is explicit (z over x, y), so a point's parameters are those of its
// plan position: safe where projecting on a wavy base surface is not (field notes on the thesis's wave
// surface).
//
// u runs along sides[0] (corner 0 to corner 1), v along sides[3] reversed (corner 0 to corner 3).
//
// Accuracy     the inverse satisfies |X(u, v) - (x, y)| <= 1e-10 mm
// Cost         a point with a neighbour's (u, v) as guess: 2-3 Newton steps, about 0.3 us
// Allocation   none in invert(); the constructor copies four curves
// Failure      Error::folded_map from check(); outside_domain from invert() when the point lies off the plate
// by more
//              than the margin asked for
#pragma once

#include <Eigen/Core>
#include <expected>

#include "geometry/outline.hpp"

namespace moldloft::geometry {

struct PlanPoint {
  Eigen::Vector2d value;
  Eigen::Matrix2d jacobian;  // columns dX/du, dX/dv
};

class PlanMap {
 public:
  PlanMap() = default;
  explicit PlanMap(const Outline& outline);
  void assign(const Outline& outline);  // without allocation when the sizes are the same

  PlanPoint at(double u, double v) const;
  std::expected<void, Error> check() const;  // Jacobian positive on a 65 x 65 grid
  // (u, v) of a plan position, starting from `guess`; outside [0, 1]^2 by at most `margin` it is still given.
  std::expected<Eigen::Vector2d, Error> invert(const Eigen::Vector2d& xy, const Eigen::Vector2d& guess,
                                               double margin = 0.0) const;

  // The map as a bicubic B-spline net over knots that contain the sides' knots: exact, since every blend is
  // bilinear in splines of degree 3. Fills x and y of `surface` for its knot vectors.
  void to_net(BSplineSurface& surface) const;

 private:
  Outline outline_;
};

}  // namespace moldloft::geometry
