// What must hold of stripes before a surface is fitted through them, so that what is wrong can be named.
//
// Cost         O(m log m) for m stripes, and the stripes' vertices
// Failure      not_finite, knots_not_increasing, no_length,
//              preimage_outside, coincident_stripes, too_few_points
#pragma once

#include "geometry/stripes/bspline_surface_fit.hpp"

#include <expected>
#include <span>

namespace moldloft::geometry {

std::expected<void, MatchingFailure> check_tracks(std::span<const double> knots_u,
                                                  std::span<const double> knots_v,
                                                  std::span<const StripeTrack>,
                                                  std::span<const SampledTrack>);

// Of the domain: a thousandth of what any device can tell apart on a plate.
constexpr double nearest_stripes = 1e-9;

// Pairs of straight lines with the same two ends within `nearest`, in either direction: the first
// that are found.
struct CoincidentPair {
  int first = -1, second = -1;  // -1: there is none
};
CoincidentPair find_coincident(std::span<const Eigen::Vector2d> from, std::span<const Eigen::Vector2d> to,
                               double nearest);

}  // namespace moldloft::geometry
