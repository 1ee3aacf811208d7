// What must hold of points, settings and sums before a net is solved, so that what is wrong can be named.
//
// Cost         the points: O(1), or one pass where a sum has overflowed; the sums: 49 multiply-adds a cell
// Failure      impossible_setting, capacity, no_extent, not_finite, negative_weight and the knots' own errors;
//              sizes_differ; too_large with the point; too_few_points; collinear
#pragma once

#include "geometry/fit/fit_surface.hpp"
#include "geometry/fit/spline_net.hpp"

#include <expected>

namespace moldloft::geometry {

// The finest grid of moments, at 0.6 kB a cell: what is larger is a slip of the caller's.
constexpr int most_cells = 1 << 20;

std::expected<void, Flaw> check_settings(const FitSettings&);

// The squares of all heights above the datum must add up to a number.
std::expected<void, Flaw> check_sums(const PointColumns&, const PointTotals&, double datum);

// Points in one place or on one line leave the plane through them open, and fairing does not close it. `net` has
// the grid's cells.
std::expected<void, Flaw> check_spread(const SplineNet& net, const MomentGrid&);

}  // namespace moldloft::geometry
