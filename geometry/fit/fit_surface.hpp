// One call from points to a surface: z(u, v) as a bicubic B-spline, least squares on a given net or on one
// chosen from a tolerance, with fairing where data are missing, robust against outliers, the boundary
// given or free.
//
//     auto fitted = fit_surface({.u = x, .v = y, .z = z}, {.domain = {0, 305, 0, 305}, .tolerance = 0.005});
//
// Points are folded into moments (moment_accumulator.hpp), so a serial and a parallel or streamed use
// differ only in who adds: fill accumulators wherever the points are, merge them, and call fit_moments().
//
// Model        the unique minimum of sum w (z - f(u, v))^2 + fairing; x and y of the surface are u
//              and v themselves
// Net          control_u x control_v over equal spans; or knots_u, knots_v; or, with control_u == 0,
//              chosen by cross-validation from one pass over the points: nested nets of finest_spans x
//              finest_spans down to 4 x 4, then nets between the best of them and its neighbours,
//              whose knots are some of the finest net's (where the points are at hand, one more pass
//              spaces them evenly)
// Accuracy     coefficients within 1e-11 of the heights' range of a dense QR solution; rms error
//              against the truth sigma sqrt(N / M) for N control points and M points, where the net can
//              follow the truth
// Cost         450,000 points on 23 x 23: 3 ms (AVX-512); the choice among five nets 10 ms
// Memory       independent of the number of points: <= 1 MiB on 23 x 23, 10 MiB on 64 x 64
// Points       any order; a net is chosen only among those with at least 4 points for every control point, so a
//              choice wants 196 of them (a given net 1 each, and with fairing any three that are on no line)
// Failure      Flaw names the error and the point, cell, coefficient or knot that it is about:
//              not_finite, too_large, negative_weight, outside_domain, sizes_differ, too_few_points, collinear
//              (in plan view), no_extent (of the domain), empty_cells, singular, impossible_setting, capacity,
//              those of knots.hpp
#pragma once

#include "geometry/fit/moment_accumulator.hpp"
#include "geometry/fit/net_choice.hpp"
#include "geometry/splines/bspline.hpp"

#include <expected>
#include <optional>
#include <vector>

namespace moldloft::geometry {

struct FairingSettings {
  // Weights of the thin-plate energy relative to the data (ratio of the matrices' traces): everywhere, and
  // on top of it in cells with fewer than sparse_points points. Zero both: cells without points are an error.
  double everywhere = 0;
  double where_sparse = 1e-5;
  std::uint32_t sparse_points = 16;
};

struct BoundarySettings {
  Eigen::MatrixXd control =
      {};  // control_u x control_v; only the outer ring is read; empty: the boundary is free
  double weight = std::numeric_limits<double>::infinity();  // in points; infinite: interpolated
};

struct FitSettings {
  int control_u = 0, control_v = 0;                // 0: chosen
  std::vector<double> knots_u = {}, knots_v = {};  // given: they decide the net
  FitDomain domain = {};                           // of the columns u and v, where no knots are given
  double tolerance = 0;                            // what a coarser net may miss (rms), in the unit of z
  NetCriterion criterion = NetCriterion::gcv;
  int finest_spans = 64;  // of the nets to choose from; a power of two, at least 4
  FairingSettings fairing = {};
  BoundarySettings boundary = {};  // for a given net only
  int robust_passes = 0;           // at most so many of Tukey's reweighting; 0: plain least squares
  bool residual_pass = false;      // one more pass over the points, for their largest residual
  bool condition = false;          // estimate it
};

struct FitReport {
  PointTotals totals;
  double rms_residual = 0, sigma = 0;  // weighted; sigma: over the degrees of freedom
  double max_residual = 0;             // 0 unless residual_pass
  int empty_cells = 0, sparse_cells = 0;
  double smallest_pivot = 0;  // relative to the largest: small means a badly determined control point,
  int smallest_pivot_i = 0, smallest_pivot_j = 0;  // this one
  double condition = 0;        // estimate of the 1-norm condition of the normal equations, 0 unless asked for
  std::vector<NetScore> nets;  // all that were tried, from fine to coarse
  std::size_t chosen = 0;      // of them
  double freedom = 0;          // degrees of freedom of the surface: at most its control points
  int robust_passes = 0;
  double robust_sigma = 0;  // from the median residual
  std::size_t bytes = 0;    // what the fit held at most, above the caller's points
};

struct FittedSurface {
  BSplineSurface surface;
  FitReport report;
};

std::expected<FittedSurface, Flaw> fit_surface(const PointColumns&, const FitSettings&);

// The same from moments that were added up before; robust and residual passes, which need the points, are
// left out. The accumulator's cells must be those of the net (accumulator_for makes such a one).
std::expected<FittedSurface, Flaw> fit_moments(const MomentAccumulator&, const FitSettings&);
std::expected<MomentAccumulator, Flaw> accumulator_for(const FitSettings&, double datum = 0);

}  // namespace moldloft::geometry
