// Cubic B-splines on clamped knot vectors: basis, curves and surfaces with explicit storage.
//
// Source       de Boor recurrence (thesis eq. 2.45, 2.50); derivatives by differenced control points
// Accuracy     values within 16 eps of the control net's size
// Cost         a curve point 40 flops per axis, a surface point 150
// Allocation   only where a vector is built or resized
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <span>
#include <vector>

namespace moldloft::geometry {

constexpr int cubic = 3;

// Clamped knots on [0, 1] with `spans` equal spans: (0,0,0,0, 1/s, ..., 1,1,1,1). Control points: spans + 3.
std::vector<double> uniform_clamped_knots(int spans);

// The span index k with knots[k] <= t < knots[k+1] (the last span for t = 1); t is clamped to the domain.
int find_span(std::span<const double> knots, double t);

// The four cubic basis functions that live on span k, and their first and second derivatives.
struct BasisValues {
  std::array<double, 4> value, first, second;
};
BasisValues cubic_basis(std::span<const double> knots, int k, double t);

// The Greville abscissa of control point i: where a control point sits on a straight line at unit speed.
double greville(std::span<const double> knots, int i);

// Coefficient i, over the knots `fine`, of the spline that has `coefficients` over the knots `coarse`; `fine` must
// contain every knot of `coarse`. Exact: the spline's blossom at three consecutive fine knots (Ramshaw 1987).
double refined_coefficient(std::span<const double> coarse, std::span<const double> coefficients,
                           std::span<const double> fine, int i);

struct CurvePoint2 {
  Eigen::Vector2d value, first, second;
};

struct PlanCurve {  // a cubic B-spline curve in plan view, mm
  std::vector<double> knots;
  std::vector<Eigen::Vector2d> control;
  CurvePoint2 at(double t) const;
};

struct SurfacePoint {
  Eigen::Vector3d value, du, dv, duu, duv, dvv;
  Eigen::Vector3d normal() const { return du.cross(dv).normalized(); }
};

// r(u, v) = sum_ij N_i(u) M_j(v) P_ij, bicubic, (u, v) in [0, 1]^2; control points in world coordinates (mm).
struct BSplineSurface {
  std::vector<double> knots_u, knots_v;
  Eigen::MatrixXd x, y, z;  // control net: rows along u, columns along v
  int control_u() const { return static_cast<int>(x.rows()); }
  int control_v() const { return static_cast<int>(x.cols()); }
  SurfacePoint at(double u, double v) const;
};

}  // namespace moldloft::geometry
