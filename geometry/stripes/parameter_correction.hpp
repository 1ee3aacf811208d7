// Fits a bicubic surface to points whose parameters are only roughly known, and corrects the parameters on
// the way: for parts that have no plan view, and for stripes whose pre-images are not straight. (A plate that
// is a graph over its plane needs none of this: plan_map.hpp gives its parameters exactly.)
//
// Method       A least squares fit at the given parameters, then rounds of two moves. The net moves by a
//              tangent-distance step (TDM; Wang, Pottmann and Liu 2006): of a point's residual only what
//              stands on the tangent plane counts, since the point's parameters will follow; that is
//              Gauss-Newton with the parameters eliminated, and at the domain's border, where a parameter
//              cannot follow, the residual counts in that direction too. Then every point's parameters go to
//              its foot by Newton steps that never lengthen its distance. Point-distance steps (PDM: refit
//              at the corrected parameters) are there for comparison: they crawl.
// Trust        the step is damped by lambda sum |surface's movement at the points|^2 (Levenberg-Marquardt in
//              the metric of the data). It is kept only if the sum of squared distances falls; if not,
//              lambda grows and the step is taken again. So no round, and no result, is worse than the fit
//              at the given parameters.
// Units        mm; parameters in the knots' domain, [0, 1]^2 as a rule
// Accuracy     points of a surface over the same knots, from parameters off by a tenth of a span: back to
//              1e-9 of their extent where the border is kept, to 1e-6 in a hundred rounds where it is free
//              (points that leave over it make the sum kink). The thesis's wave from chord-length parameters:
//              1e-15 to 1e-6, see README.md of this folder. Far off, as with the strong wave under oblique
//              stripes, it ends in a better fit of the points that need not be the part: the report tells by
//              its rms. Parameters are feet: residual orthogonal to 1e-9 of the tangent
// Cost         a round: a point about 1.5 us, the solution 3 half_band^2 a control point with half_band
//              = 3 (3 n + 4), n the shorter side of the net. 1,296 points on 11 x 11: 2.5 ms a round; 10
//              to 40 rounds
// Allocation   the equations at the start, a copy of net and feet a round; not for the control thread
// Failure      Error::too_few_points (fewer than free control points, or points without parameters),
//              not_finite, outside_domain (a parameter off the knots), collinear (parameters that span no
//              area), knots_not_increasing (not clamped, not increasing, an interior knot of multiplicity
//              over 3), singular (a control point that no point sees, without fairing)
#pragma once

#include "geometry/error.hpp"
#include "geometry/splines/bspline.hpp"

#include <Eigen/Core>

#include <cstdint>
#include <expected>
#include <span>
#include <string_view>
#include <vector>

namespace moldloft::geometry {

enum class CorrectionStep : std::uint8_t { tangent_distance, point_distance };

struct CorrectionSettings {
  CorrectionStep step = CorrectionStep::tangent_distance;
  int most_rounds = 100;    // steps tried, kept or not
  double enough_mm = 1e-9;  // ends when the rms distance is no longer than this
  // Ends when three rounds in a row shorten the sum of squares by less than this share of it.
  double least_gain = 1e-4;
  // Weight of the thin-plate energy of each coordinate, relative to the traces. It enters only where the data
  // alone leave the net open (a pivot below 1e-10 of the largest), and so small that it decides nothing else.
  // A hole wide against the spans wants 1e-7.
  double fairing = 1e-12;
  // The outer ring of control points stays that of the surface given: known boundary curves
  // (thesis eq. 3.40).
  bool keep_border = false;
};

enum class CorrectionEnd : std::uint8_t {
  close_enough,  // enough_mm
  settled,       // least_gain
  no_descent,    // no step, however short, makes the distances smaller: the rounding of the data
  most_rounds,
};
std::string_view to_string(CorrectionEnd) noexcept;

struct CorrectionReport {
  double start_rms_mm = 0;         // of the fit at the given parameters, before any correction
  double rms_mm = 0, max_mm = 0;   // distance of the points from the surface
  int accepted = 0, rejected = 0;  // net steps
  std::vector<double> sums_mm2;    // sum of squared distances: at the start, then after every accepted round
  // Of the first fit, unfaired: how well the data determine the net. Where they do not, the fairing entered.
  double smallest_pivot = 0, largest_pivot = 0;
  bool faired = false;
  CorrectionEnd end = CorrectionEnd::most_rounds;
};

struct CorrectedFit {
  BSplineSurface surface;
  std::vector<Eigen::Vector2d> parameters;  // of every point: its foot on the surface
  CorrectionReport report;
};

// `frame` gives the knots and, with keep_border, the ring of control points to keep; its other control points
// are not looked at.
std::expected<CorrectedFit, Error> fit_with_parameter_correction(std::span<const Eigen::Vector3d> points,
                                                                 std::span<const Eigen::Vector2d> parameters,
                                                                 const BSplineSurface& frame,
                                                                 const CorrectionSettings& = {});

// Where the method starts for a stripe: its pre-image taken as the straight line from (u, v) `from` to `to`,
// its points placed by chord length. Points that all coincide sit at `from`.
std::vector<Eigen::Vector2d> chord_length_parameters(std::span<const Eigen::Vector3d> stripe,
                                                     const Eigen::Vector2d& from, const Eigen::Vector2d& to);

}  // namespace moldloft::geometry
