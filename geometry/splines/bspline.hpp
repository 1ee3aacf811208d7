// B-spline curves and surfaces on clamped knot vectors: what they are made of, and evaluation.
//
// Source       thesis section 2.4: basis (2.45), de Boor's triangle (2.50, 2.51)
// Units        control points in mm here; parameters in the knots' domain, arguments are clamped to it
// Accuracy     values within 8 p eps of the largest control coordinate of the curve, 8 (p + q) eps
//              for a surface of degrees p, q. First derivatives likewise of the largest control point
//              of the derivative.
// Cost         bicubic value and all first and second derivatives 50 ns on a server core of 2023, some 30
//              more where uneven knots must be searched; bi-quartic 230 ns
// Allocation   none in at(), value() and de_boor()
// Expects      knots that pass check_knots() with as many control points as there are;
//              degrees <= most_spline_degree
#pragma once

#include "geometry/nonblocking.hpp"
#include "geometry/splines/bspline_basis.hpp"
#include "geometry/splines/knots.hpp"

#include <Eigen/Geometry>

#include <span>
#include <vector>

namespace moldloft::geometry {

// Coefficient i, over the knots `fine`, of the cubic spline that has `coefficients` over the knots
// `coarse`; `fine` must contain every knot of `coarse`. Exact: the spline's blossom at three consecutive
// fine knots (Ramshaw 1987). Without allocation; refine_coefficients() of refinement.hpp does all at once,
// at any degree.
double refined_coefficient(std::span<const double> coarse, std::span<const double> coefficients,
                           std::span<const double> fine, int i);

template <int dim>
struct CurvePoint {
  Eigen::Matrix<double, dim, 1> value, first, second;
};
using CurvePoint2 = CurvePoint<2>;

// c(t) = sum_i N_i(t) P_i. Made for dim 1, 2 and 3.
template <int dim>
struct BSplineCurve {
  using Point = Eigen::Matrix<double, dim, 1>;

  std::vector<double> knots;
  std::vector<Point> control;
  int degree = cubic;

  double begin() const { return knots[degree]; }
  double end() const { return knots[knots.size() - degree - 1]; }
  CurvePoint<dim> at(double t) const MOLDLOFT_GEOMETRY_NONBLOCKING;
  Point value(double t) const { return at(t).value; }
  Point de_boor(double t) const;  // the same value by the triangle of convex combinations (2.50, 2.51)
};
using HeightCurve = BSplineCurve<1>;
using PlanCurve = BSplineCurve<2>;  // in plan view, mm
using SpaceCurve = BSplineCurve<3>;

extern template struct BSplineCurve<1>;
extern template struct BSplineCurve<2>;
extern template struct BSplineCurve<3>;

struct SurfacePoint {
  Eigen::Vector3d value, du, dv, duu, duv, dvv;
  Eigen::Vector3d normal() const { return du.cross(dv).normalized(); }
};

// r(u, v) = sum_ij N_i(u) M_j(v) P_ij, bicubic unless its degrees say otherwise; control points in
// world coordinates (mm).
struct BSplineSurface {
  std::vector<double> knots_u, knots_v;
  Eigen::MatrixXd x, y, z;  // control net: rows along u, columns along v
  int degree_u = cubic, degree_v = cubic;

  int control_u() const { return static_cast<int>(x.rows()); }
  int control_v() const { return static_cast<int>(x.cols()); }
  bool bicubic() const { return degree_u == cubic && degree_v == cubic; }
  SurfacePoint at(double u, double v) const;
};

// What check_knots() finds in either direction, knots_wrong_count for nets of different or
// wrong sizes, not_finite.
template <int dim>
std::expected<void, Error> check(const BSplineCurve<dim>& curve);
std::expected<void, Error> check(const BSplineSurface& surface);

}  // namespace moldloft::geometry
