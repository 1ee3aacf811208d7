// A stripe's pre-image on a B-spline surface, and its cuts: at the stripe's own knots and where the
// pre-image crosses the surface's knot lines, so that on every piece both stripe and surface are polynomials
// (thesis section 3.3).
//
// Units        (u, v) and t are parameters; nothing here is a length in mm
// Accuracy     cuts within 4 eps of the parameters' size; two cuts nearer than 1e-12 in t are one
// Cost         O(c log c) for the c cuts of a stripe
// Allocation   the vectors that are returned or appended to
// Failure      not_finite, knots_not_increasing, no_length, preimage_outside
#pragma once

#include "geometry/error.hpp"

#include <Eigen/Core>

#include <expected>
#include <span>
#include <vector>

namespace moldloft::geometry {

// A path in (u, v) that is straight between its vertices, each reached at its own t. Two vertices are the
// thesis's straight line (eq. 3.4), more of them a stripe that is not straight there.
struct Preimage {
  std::vector<double> t;  // increasing; from the stripe's first knot to its last
  std::vector<Eigen::Vector2d> uv;
  Eigen::Vector2d at(double t) const;
};

Preimage straight_preimage(const Eigen::Vector2d& from, const Eigen::Vector2d& to);  // t from 0 to 1

struct TrackPiece {
  int stripe_span, span_u, span_v;  // find_span() of the stripe's and the surface's knots
  double t0, t1;
  Eigen::Vector2d uv0, uv1;  // the pre-image at t0 and t1, straight between them
  double length() const { return (uv1 - uv0).norm(); }
};

// Whether the pre-image has length everywhere and stays in [knots_u domain] x [knots_v domain]; the
// knots are valid.
std::expected<void, Error> check_preimage(const Preimage&, std::span<const double> stripe_knots,
                                          std::span<const double> knots_u, std::span<const double> knots_v);

// Appends the pieces in the order of t. Expects arguments that have passed the checks above.
void cut_stripe(const Preimage&, std::span<const double> stripe_knots, std::span<const double> knots_u,
                std::span<const double> knots_v, std::vector<TrackPiece>& pieces);

}  // namespace moldloft::geometry
