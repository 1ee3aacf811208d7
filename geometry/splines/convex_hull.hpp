// The convex hull of points in a plane.
#pragma once

#include <Eigen/Core>

#include <vector>

namespace moldloft::geometry {

// Counter-clockwise, without points on its edges; begins at the leftmost point, the lowest of several. At least one
// point is needed. Cost O(n log n): Andrew's monotone chain (1979).
std::vector<Eigen::Vector2d> convex_hull(std::vector<Eigen::Vector2d> points);

}  // namespace moldloft::geometry
