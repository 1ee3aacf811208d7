// Bezier curves and surfaces of any degree, and the Bezier pieces of B-splines (thesis sections
// 2.3, 2.4, 3.2).
//
// Units        those of the control points; parameters in [0, 1]
// Accuracy     values, pieces, raised degrees and restrictions within 4 n eps of the largest control
//              coordinate, n the degree (for a surface: the sum of both)
// Cost         a curve point n^2, a surface point 9 (n + 1) (m + 1) + n^2 + m^2
// Allocation   none in at(); elsewhere what is returned
// Failure      none; degrees to most_bernstein_degree (asserted)
#pragma once

#include "geometry/splines/bernstein_form.hpp"
#include "geometry/splines/bspline.hpp"

#include <Eigen/Core>

#include <vector>

namespace moldloft::geometry {

template <int dim>
struct BezierCurve {
  Eigen::Matrix<double, Eigen::Dynamic, dim> control;  // a row a control point: a Bernstein form

  int degree() const { return static_cast<int>(control.rows()) - 1; }
  CurvePoint<dim> at(double t) const;  // value and both derivatives, from one triangle of de Casteljau
};

struct BezierSurface {
  Eigen::MatrixXd x, y, z;  // control net: rows along u, columns along v

  int degree_u() const { return static_cast<int>(x.rows()) - 1; }
  int degree_v() const { return static_cast<int>(x.cols()) - 1; }
  SurfacePoint at(double u, double v) const;
};

template <int dim>
struct SplitBezier {
  BezierCurve<dim> left, right;
};
template <int dim>
SplitBezier<dim> split(const BezierCurve<dim>& curve, double t);
template <int dim>
BezierCurve<dim> elevate(const BezierCurve<dim>& curve, int degree);
template <int dim>
BezierCurve<dim> restrict_to(const BezierCurve<dim>& curve, double a, double b);  // a and b in any order

BezierSurface elevate(const BezierSurface& surface, int degree_u, int degree_v);

// The surface on a box of its domain, over [0, 1]^2 again; a side of the box may run backwards. Subdivision
// is this with boxes that share a side.
struct ParameterBox {
  double begin_u, end_u, begin_v, end_v;
};
BezierSurface restrict_to(const BezierSurface& surface, const ParameterBox& box);

// The polynomial pieces of a B-spline curve, one for every span that is not empty, in order.
template <int dim>
struct BezierPiece {
  double begin, end;
  BezierCurve<dim> curve;
};
template <int dim>
std::vector<BezierPiece<dim>> bezier_pieces(const BSplineCurve<dim>& curve);

// The patches of a B-spline surface; u runs fastest.
struct BezierPatch {
  ParameterBox box;
  BezierSurface surface;
};
std::vector<BezierPatch> bezier_patches(const BSplineSurface& surface);

}  // namespace moldloft::geometry
