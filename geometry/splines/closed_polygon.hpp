// Closed polygons in a plane: what an outline or a loop of trim curves is once its curves are cut into
// chords. The last point is joined to the first; it is not repeated.
//
// Frame        any; lengths in the caller's unit
// Accuracy     signed_area within 4 n eps times the square of the polygon's extent
// Cost         signed_area and contains O(n); crosses_itself O(n^2) in the worst case, O(n) boxes looked at
//              for each edge
// Allocation   none
// Failure      none: a polygon of fewer than three points has no area, contains nothing and crosses nothing
#pragma once

#include <Eigen/Core>

#include <span>

namespace moldloft::geometry {

double signed_area(std::span<const Eigen::Vector2d>);  // positive: counter-clockwise

// Even-odd rule. A point on an edge belongs to one of its two sides, the same one every time.
bool contains(std::span<const Eigen::Vector2d>, const Eigen::Vector2d& point);

// Whether two edges that are not neighbours touch, or an edge turns back on its neighbour.
bool crosses_itself(std::span<const Eigen::Vector2d>);
// Whether an edge of one touches an edge of the other.
bool cross(std::span<const Eigen::Vector2d>, std::span<const Eigen::Vector2d>);

}  // namespace moldloft::geometry
