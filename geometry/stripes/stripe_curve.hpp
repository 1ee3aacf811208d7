// From the points of one stripe and their (u, v) to what the surface is fitted to: the stripe as a cubic
// B-spline curve and its straight pre-image (thesis section 3.2.1). How the curve is parametrized decides
// about the surface: by chord lengths, as is usual, the curve is at another place than its pre-image says
// wherever the surface climbs.
//
// Units        points in mm; (u, v) and t are parameters
// Accuracy     the least squares curve of curve_fit.hpp; consistent t within 4 eps over
//              the pre-image's length
// Cost         the curve fit's
// Allocation   what is returned
// Failure      Flaw: sizes_differ, no_length (the pre-image), what fit_curve() finds (repeated_points:
//              (u, v) that go backwards along the pre-image)
#pragma once

#include "geometry/splines/curve_fit.hpp"
#include "geometry/stripes/bspline_surface_fit.hpp"

#include <Eigen/Core>

#include <expected>
#include <span>
#include <vector>

namespace moldloft::geometry {

enum class StripeParameter {
  chord_length,  // lengths of the chords between the points: needs no (u, v) but the ends'
  consistent,    // how far each point's (u, v) has come along the pre-image
};

// t in [0, 1] of every (u, v), by its foot on the straight line from `from` to `to`; beyond the ends the end.
std::vector<double> consistent_parameters(std::span<const Eigen::Vector2d> uv, const Eigen::Vector2d& from,
                                          const Eigen::Vector2d& to);

struct StripeCurve {
  StripeTrack track;
  SpaceCurve curve;
  double rms_mm = 0, max_mm = 0;  // the points about the curve
};

// `uv` has an entry a point; the pre-image is straight from the first to the last. `knots` are clamped
// on [0, 1].
std::expected<StripeCurve, Flaw> fit_stripe(std::span<const Eigen::Vector3d> points,
                                            std::span<const Eigen::Vector2d> uv,
                                            std::span<const double> knots, StripeParameter);

}  // namespace moldloft::geometry
