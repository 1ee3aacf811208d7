// The same spline in another form: more knots, a higher degree, pieces. Every control point of the new form
// is a convex combination of the old ones, so nothing can grow.
//
// Source       Boehm's insertion (thesis eq. 2.63, 2.64); Bezier extraction (thesis 2.4, 3.20-3.34); degree
//              elevation by averaging the insertions that leave out one knot each (Prautzsch 1984)
// Coefficients matrices, a row a control point, any number of columns: the axes of a curve, or a
// whole surface net
// Accuracy     the spline moves by at most 4 eps times its largest control coordinate for every degree and
//              every knot inserted: 4 (p + inserted) eps
// Cost         Boehm's insertion p rows changed, all behind it moved; elevation as many insertions
//              as knots, squared
// Allocation   what is returned
// Failure      none; knots must pass check_knots(), new ones lie in the domain (asserted)
#pragma once

#include "geometry/splines/bspline.hpp"

#include <Eigen/Core>

#include <span>
#include <vector>

namespace moldloft::geometry {

struct SplineCoefficients {
  std::vector<double> knots;
  Eigen::MatrixXd rows;
};

// One more knot at an interior t, which may stand there up to `degree` times already.
SplineCoefficients insert_knot(std::span<const double> knots, int degree, const Eigen::MatrixXd& rows,
                               double t);

// Over the knots `fine`, which hold every one of `knots` at least as often.
Eigen::MatrixXd refine_coefficients(std::span<const double> knots, int degree, const Eigen::MatrixXd& rows,
                                    std::span<const double> fine);

// The matrix that does so, fine control points by coarse ones: entries not negative, rows add up
// to 1, banded.
Eigen::MatrixXd refinement_matrix(std::span<const double> knots, int degree, std::span<const double> fine);

// One degree more: every knot stands once more.
SplineCoefficients elevate_coefficients(std::span<const double> knots, int degree,
                                        const Eigen::MatrixXd& rows);

// `fine` with `t` standing `degree` times: where a spline is cut, or its pieces are to be read off.
std::vector<double> with_full_knot(std::span<const double> knots, int degree, double t);

// Curves. split() cuts at an interior parameter; both halves keep their parameters.
template <int dim>
BSplineCurve<dim> refine(const BSplineCurve<dim>& curve, std::span<const double> fine);
template <int dim>
BSplineCurve<dim> elevate(const BSplineCurve<dim>& curve, int degree);
template <int dim>
struct SplitCurve {
  BSplineCurve<dim> left, right;
};
template <int dim>
SplitCurve<dim> split(const BSplineCurve<dim>& curve, double t);
template <int dim>
BSplineCurve<dim> reversed(const BSplineCurve<dim>& curve);  // c(begin + end - t)

// Both curves at the higher of their degrees over the union of their knots. With a tolerance above
// 0, knots that close count as one, and a curve whose knot was moved changes by tolerance times
// its derivative (knots.hpp).
template <int dim>
void make_compatible(BSplineCurve<dim>& a, BSplineCurve<dim>& b, double tolerance = 0);

// Surfaces.
BSplineSurface refine(const BSplineSurface& surface, std::span<const double> fine_u,
                      std::span<const double> fine_v);
BSplineSurface elevate(const BSplineSurface& surface, int degree_u, int degree_v);
struct SplitSurface {
  BSplineSurface low, high;
};
SplitSurface split_u(const BSplineSurface& surface, double u);
SplitSurface split_v(const BSplineSurface& surface, double v);

}  // namespace moldloft::geometry
