// Bicubic surfaces through values at their Greville places: a formula, or a surface of another kind, as one of ours.
//
// Source       Greville 1964; de Boor, A Practical Guide to Splines, IX: interpolation there is well conditioned
// Cost         O(n^3) for n control points each way, once
// Allocation   yes
// Expects      clamped cubic knots without an interior knot more than three times
#pragma once

#include "geometry/splines/bspline.hpp"

#include <vector>

namespace moldloft::geometry {

// Means of three neighbouring knots, one for each control point.
std::vector<double> greville_places(const std::vector<double>& knots);

// Values: rows along u, at the Greville places of both knot vectors.
BSplineSurface surface_through(const std::vector<double>& knots_u, const std::vector<double>& knots_v,
                               const Eigen::MatrixXd& x, const Eigen::MatrixXd& y, const Eigen::MatrixXd& z);

}  // namespace moldloft::geometry
