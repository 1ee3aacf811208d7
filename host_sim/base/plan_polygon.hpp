// Polygons in plan view: closed, counter-clockwise, without crossing themselves; mm.
//
// Cost         linear in the number of vertices unless said otherwise
// Allocation   only where a vector is returned
#pragma once

#include <Eigen/Core>

#include <array>
#include <span>
#include <vector>

namespace moldloft::host_sim {

using PlanPoints = std::span<const Eigen::Vector2d>;

double signed_area(PlanPoints);  // positive when counter-clockwise
Eigen::Vector2d centroid(PlanPoints);
bool contains(PlanPoints, double x, double y) noexcept;
bool is_convex(PlanPoints) noexcept;
double distance_to_outline(PlanPoints, const Eigen::Vector2d&) noexcept;

// The convex hull, counter-clockwise. Cost n log n.

// The corners of an approximately four-sided outline: the four hull vertices that span the
// quadrilateral of largest area. They go counter-clockwise from the one of smallest x + y. Cost
// quadratic in the hull's vertices.
std::array<Eigen::Vector2d, 4> largest_quadrilateral(PlanPoints);

// Points along the closed outline, at most `step_mm` apart, all vertices among them.
std::vector<Eigen::Vector2d> sampled_outline(PlanPoints, double step_mm);

}  // namespace moldloft::host_sim
