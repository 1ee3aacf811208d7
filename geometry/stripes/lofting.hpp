// Lofting: a surface whose lines of constant u are given curves (thesis eq. 2.70-2.82).
//
// Curve k runs along v and becomes the line u = u_k; u_k is the mean of the chord-length parameters of the
// curves' first and last points (2.70). Interpolation has as many control points along u as there are curves
// (2.74); fewer of them fit the curves' control points in the least squares sense (2.82), which is what
// kinked, noisy curves want.
//
// Units        millimetres; u in [0, 1], v as the curves have it
// Accuracy     the solution of the equations within 4 m p eps times the condition number of [N] (m curves,
//              degree p), of the largest coordinate. With averaged knots it interpolates; a surface of degree
//              p in u comes back.
// Cost         m p (p + 3 n) for n control points a curve
// Allocation   what is returned, and the triangle of the equations
// Failure      a Flaw, where it says `where`:
//
// too_few_points         fewer curves than control points or than degree + 1 (`where`: how many there are)
// curves_not_compatible  curve `where` has another degree or other knots than the first (make_compatible())
// coincident_curves      both ends of curve `where` lie where those of the one before it do
// span_without_points    control point `where` along u has no curve of its own
// singular               it hardly has
// what check() finds in curve `where`
#pragma once

#include "geometry/error.hpp"
#include "geometry/splines/banded_least_squares.hpp"
#include "geometry/splines/bspline.hpp"

#include <expected>
#include <span>
#include <vector>

namespace moldloft::geometry {

struct LoftSettings {
  int degree = cubic;             // along u
  int control_points = 0;         // along u; 0: one for each curve, interpolation
  bool interpolate_ends = false;  // approximation keeps the first and the last curve as they are
};

struct Loft {
  BSplineSurface surface;
  std::vector<double> parameters;  // u_k
  double rms = 0, max = 0;  // distances between the curves' control points and those of the lines u = u_k
  Pivots pivots{};
};

// The mean chord-length parameters of the rows of first and of last points (2.70). A row without length,
// where all curves meet in one point, has no say.
std::expected<std::vector<double>, Flaw> loft_parameters(std::span<const SpaceCurve> curves);

// Knots averaged (interpolation) or balanced (approximation) over the u_k.
std::expected<Loft, Flaw> loft(std::span<const SpaceCurve> curves, const LoftSettings& settings = {});

// With parameters (increasing) and knots along u of the caller's choice; settings.control_points has no say.
std::expected<Loft, Flaw> loft(std::span<const SpaceCurve> curves, std::span<const double> parameters,
                               std::span<const double> knots_u, const LoftSettings& settings = {});

}  // namespace moldloft::geometry
