// A closed polyline as smooth sides: cubic splines through its points, joined at its corners.
//
// The polyline is taken as exact: noise is to be smoothed before. A corner is where it turns by more than
// `corner_angle`. Points between two corners are joined by an interpolating C2 spline over the chord length,
// two points by a straight line at constant speed, three by a parabola; a polyline without corners becomes
// one closed side, smooth at its seam too.
//
// Source       not-a-knot and periodic end conditions (de Boor 1978, ch. IV)
// Frame        the polyline's; sides run counter-clockwise
// Accuracy     passes within 8 eps of the extent of every point; between points of a smooth side O(h^4), on a
//              closed one at equal distances h of arc at most 1.1 (5/384) h^4 max |c''''|
// Cost         O(n)
// Allocation   yes
// Failure      too_few_points: fewer than three points that differ from their neighbours; not_finite
#pragma once

#include "geometry/error.hpp"
#include "geometry/splines/bspline.hpp"

#include <expected>
#include <span>
#include <vector>

namespace moldloft::geometry {

std::expected<std::vector<PlanCurve>, Error> smooth_sides(std::span<const Eigen::Vector2d> polyline,
                                                          double corner_angle);

}  // namespace moldloft::geometry
