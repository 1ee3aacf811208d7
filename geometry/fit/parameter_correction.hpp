// Fits a bicubic surface to points whose parameters are only roughly known, and corrects the parameters on the way: for
// parts that have no plan view, and for stripes whose pre-images are not straight. (A plate that is a graph over its plane
// needs none of this: plan_map.hpp gives its parameters exactly.)
//
// Method       A least squares fit at the given parameters, then rounds of two moves. The net moves by a tangent-distance
//              step (TDM; Wang, Pottmann and Liu 2006): of a point's residual only what stands on the tangent plane counts,
//              since the point's parameters will follow; that is Gauss-Newton with the parameters eliminated, and at the
//              domain's border, where a parameter cannot follow, the residual counts in that direction too. Then every
//              point's parameters go to its foot by Newton steps that never lengthen its distance.
//              Trust region: the step is damped by lambda sum |surface's movement at the points|^2 (Levenberg-Marquardt in
//              the metric of the data). It is kept only if the sum of squared distances falls; if not, lambda grows and
//              the step is taken again. So no round, and no result, is worse than the fit at the given parameters.
//              Point-distance steps (PDM: refit at the corrected parameters) are there for comparison: they crawl.
// Units        mm; parameters in the knots' domain, [0, 1]^2 as a rule
// Accuracy     points of a surface over the same knots: reproduced to 1e-9 of their extent, if the start lies in the basin.
//              The thesis's wave from chord-length parameters: see README.md of this folder
// Cost         a round: a point about 1 us, the solution 9 half_band^2 a control point with half_band = 3 (3 n + 4), n the
//              shorter side of the net. 1,296 points on 11 x 11: about 4 ms a round; 10 to 40 rounds
// Allocation   everything, at the start; not for the control thread
// Failure      Error::too_few_points (fewer than free control points, or points without parameters), not_finite,
//              outside_domain (a parameter off the knots), collinear (parameters that span no area),
//              knots_not_increasing (not clamped, not increasing, an interior knot of multiplicity over 3), singular (a
//              control point that no point sees, without fairing)
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <expected>
#include <span>
#include <string_view>
#include <vector>

#include "geometry/error.hpp"
#include "geometry/splines/bspline.hpp"

namespace moldloft::geometry {

enum class CorrectionStep : std::uint8_t { tangent_distance, point_distance };

struct CorrectionSettings {
  CorrectionStep step = CorrectionStep::tangent_distance;
  int most_rounds = 100;     // steps tried, kept or not
  double enough_mm = 1e-12;  // ends when the rms distance is no longer than this
  // Ends when three rounds in a row shorten the sum of squares by less than this share of it.
  double least_gain = 1e-5;
  // Weight of the thin-plate energy of each coordinate, relative to the traces. So small it only decides what the data
  // leave open: 1e-12 moves an exactly represented surface by about 1e-12 of its height.
  double fairing = 1e-12;
  // The outer ring of control points stays that of the surface given: known boundary curves (thesis eq. 3.40).
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
  double smallest_pivot = 0,
         largest_pivot = 0;  // of the first fit: their ratio tells how well the data determine it
  CorrectionEnd end = CorrectionEnd::most_rounds;
};

struct CorrectedFit {
  BSplineSurface surface;
  std::vector<Eigen::Vector2d> parameters;  // of every point: its foot on the surface
  CorrectionReport report;
};

// `frame` gives the knots and, with keep_border, the ring of control points to keep; its other control points are not
// looked at.
std::expected<CorrectedFit, Error> fit_with_parameter_correction(std::span<const Eigen::Vector3d> points,
                                                                 std::span<const Eigen::Vector2d> parameters,
                                                                 const BSplineSurface& frame,
                                                                 const CorrectionSettings& = {});

// Where the method starts for a stripe: its pre-image taken as the straight line from (u, v) `from` to `to`, its points
// placed by chord length. Points that all coincide sit at `from`.
std::vector<Eigen::Vector2d> chord_length_parameters(std::span<const Eigen::Vector3d> stripe,
                                                     const Eigen::Vector2d& from, const Eigen::Vector2d& to);

}  // namespace moldloft::geometry
