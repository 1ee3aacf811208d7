// The convex hull of points in a plane.
#pragma once

#include <Eigen/Core>

#include <vector>

namespace moldloft::geometry {

// Counter-clockwise, without points on its edges; begins at the leftmost point, the lowest of several. At least one
// point is needed. Cost O(n log n): Andrew's monotone chain (1979).
std::vector<Eigen::Vector2d> convex_hull(std::vector<Eigen::Vector2d> points);

// The rectangle of least area round a convex polygon; one of its sides lies on one of the polygon's (Freeman and
// Shapira 1975). Of a polygon without area the width is 0. Cost O(n^2).
struct PlanRectangle {
  Eigen::Vector2d along = Eigen::Vector2d::UnitX();  // unit vector of the longer side
  double length = 0, width = 0;
};
PlanRectangle smallest_rectangle(const std::vector<Eigen::Vector2d>& hull);

}  // namespace moldloft::geometry
