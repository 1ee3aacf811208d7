// Least squares B-spline curves through a stripe of points (thesis section 3.2.1; The NURBS Book 9.4): over
// given knots, or with as few control points as a tolerance allows, or as many as cross-validation asks for.
//
// Units        those of the points (mm here); parameters in the knots' domain, [0, 1] where they
//              are chosen here
// Accuracy     the least squares solution within 4 N p eps times the condition number of the collocation
//              matrix, of the largest coordinate; a polynomial or spline that the knots can represent comes
//              back within that
// Cost         N p^2 for a fit; N p^2 for every number of control points that is tried
// Allocation   what is returned, and a triangle of n (p + 4) numbers
// Failure      a Flaw, where it says `where`:
//
// too_few_points       fewer points than control points (`where`: how many there are)
// not_finite           the point or parameter `where`
// repeated_points      points where - 1 and where lie in one place, or the parameter `where` is below the
//                      one before it
// outside_domain       the parameter `where` lies off the knots' domain
// sizes_differ         not as many parameters as points
// span_without_points  Schoenberg and Whitney: control point `where` has no parameter of its own between
//                      knots[where] and knots[where + degree + 1]
// singular             it has, but so near the border of that span that rounding decides about
//                      control point `where`
// tolerance_not_met    `where`: the number of control points that came closest
// what check_knots() finds, with `where` = 0
#pragma once

#include "geometry/error.hpp"
#include "geometry/splines/banded_least_squares.hpp"
#include "geometry/splines/bspline.hpp"

#include <expected>
#include <span>
#include <vector>

namespace moldloft::geometry {

struct CurveFitSettings {
  int degree = cubic;
  bool interpolate_ends = false;  // the first and last control points are the first and last points
};

template <int dim>
struct CurveFit {
  BSplineCurve<dim> curve;
  std::vector<double> parameters;  // of the points
  double rms = 0, max = 0;         // distances from the points to the curve at their parameters
  int farthest = 0;                // the point that `max` belongs to
  Pivots pivots{};  // of the least squares triangle: ratio() near 0 means that data hardly decide
};

template <int dim>
using Points = std::span<const Eigen::Matrix<double, dim, 1>>;

// Parameters in [0, 1] by the lengths of the chords between consecutive points.
template <int dim>
std::expected<std::vector<double>, Flaw> chord_length_parameters(Points<dim> points);

// Over `knots`, each point at its parameter (not decreasing); and with chord lengths.
template <int dim>
std::expected<CurveFit<dim>, Flaw> fit_curve(Points<dim> points, std::span<const double> parameters,
                                             std::span<const double> knots,
                                             const CurveFitSettings& settings = {});
template <int dim>
std::expected<CurveFit<dim>, Flaw> fit_curve(Points<dim> points, std::span<const double> knots,
                                             const CurveFitSettings& settings = {});

// The fewest control points, on balanced knots (knots.hpp), with which no point is farther off than
// `tolerance`; every number from degree + 1 up is tried, so there is no smaller one.
template <int dim>
std::expected<CurveFit<dim>, Flaw> fit_curve_within(Points<dim> points, std::span<const double> parameters,
                                                    double tolerance, const CurveFitSettings& settings = {});

// The number of control points n, up to half the points, with the least generalized cross-validation score
// (RSS / N) / (1 - n / N)^2 (Craven and Wahba 1979): what noise of unknown size supports.
template <int dim>
std::expected<CurveFit<dim>, Flaw> fit_curve_by_cross_validation(Points<dim> points,
                                                                 std::span<const double> parameters,
                                                                 const CurveFitSettings& settings = {});

// The first control point among [first, end) that Schoenberg and Whitney find without a parameter of its own;
// `end` if all have one. Parameters must not decrease.
int first_without_parameter(std::span<const double> knots, int degree, std::span<const double> parameters,
                            int first, int end);

}  // namespace moldloft::geometry
