// Lines through edge points in plan view: robust fits, false points, and the split of a bent stretch
// into two lines.
//
// Units        mm, plan view (x, y) of the edge points
// Cost         fit_edge_line O(n) a pass, five passes; best_split O(n); is_false_point constant
// Allocation   none
#pragma once

#include "geometry/edges/boundary_view.hpp"

#include <Eigen/Core>

#include <span>

namespace moldloft::geometry {

struct EdgeLine {
  Eigen::Vector2d centre = Eigen::Vector2d::Zero();
  Eigen::Vector2d direction = Eigen::Vector2d::UnitX();  // unit, from the first point towards the last
  double rms_mm = 0;                                     // of the points that kept weight
  double distance(const Eigen::Vector2d& p) const {      // signed, positive to the left
    const Eigen::Vector2d d = p - centre;
    return direction.x() * d.y() - direction.y() * d.x();
  }
};

// Orthogonal regression, reweighted with Huber's function so that a few false points do not tilt it. At
// least 2 points.
EdgeLine fit_edge_line(std::span<const EdgePoint> points);

// Where two lines meet. Lines within 0.03 rad of parallel give nothing, nor do lines that are
// no finite numbers.
std::optional<Eigen::Vector2d> meeting_point(const EdgeLine&, const EdgeLine&);

// True when the point at `index` lies on neither the line of its five predecessors nor that of its five
// successors: a corner's points always lie on one of them. Near an end the four outermost points stand for
// what is missing.
bool is_false_point(std::span<const EdgePoint> points, std::size_t index);

// The split s for which the two lines through points [0, s) and [s, n) leave the smallest sum of squares,
// each side with at least `min_side` points; 0 when there are too few points.
std::size_t best_split(std::span<const EdgePoint> points, std::size_t min_side);

// The same among the points within `length_mm` of the one farthest from the chord.
std::size_t split_at_farthest(std::span<const EdgePoint> points, double length_mm, std::size_t min_side);

// The stretch of points within `length_mm` of its first (or last) point, at least `min_points` of them.
std::span<const EdgePoint> first_stretch(std::span<const EdgePoint>, double length_mm,
                                         std::size_t min_points);
std::span<const EdgePoint> last_stretch(std::span<const EdgePoint>, double length_mm, std::size_t min_points);

}  // namespace moldloft::geometry
