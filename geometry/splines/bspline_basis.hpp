// The B-spline basis (thesis eq. 2.45) on one span: values, derivatives, and its polynomials
// in Bernstein form.
//
// Only the degree + 1 functions N_{k-p} ... N_k live on span k (knots[k] <= t <= knots[k+1], not empty).
//
// Domain       t in the span; outside it the same polynomials go on, and the bounds do not hold
// Accuracy     values and piece_extraction() relative within 4 p eps (sums of nonnegative terms); a
//              derivative of order m within 4 p eps times the sum of the absolute values of what it is
//              the difference of
// Cost         p^2 for values; (m + 1) p^2 for derivatives to order m; the cubic 60 flops and 6 divisions
// Allocation   none, but for the matrix that piece_extraction() returns
#pragma once

#include "geometry/splines/knots.hpp"

#include <Eigen/Core>

#include <array>
#include <span>

namespace moldloft::geometry {

// The four cubic basis functions that live on span k, and their first and second derivatives.
struct BasisValues {
  std::array<double, 4> value, first, second;
};
BasisValues cubic_basis(std::span<const double> knots, int k, double t) MOLDLOFT_GEOMETRY_NONBLOCKING;

// Any degree: values[i] = N_{k-p+i}(t), i = 0..p; `values` has room for p + 1.
void basis_functions(std::span<const double> knots, int degree, int k, double t, std::span<double> values);

// values[m * (p + 1) + i] = the m-th derivative of N_{k-p+i} at t, m = 0..orders.
void basis_derivatives(std::span<const double> knots, int degree, int k, double t, int orders,
                       std::span<double> values) MOLDLOFT_GEOMETRY_NONBLOCKING;

// The spline's piece on span k, cut to [a, b] within the span, in Bernstein form (thesis eq. 3.6 and
// 3.20-3.34 in one): M with N_{k-p+i}(a + (b - a) t) = sum_l M(i, l) B_l^p(t), rows i, columns l, both 0..p.
// The whole span is Bezier extraction: the Bezier control points of the piece are M' times its B-spline
// control points k-p ... k.
Eigen::MatrixXd piece_extraction(std::span<const double> knots, int degree, int k, double a, double b);

// The same recurrence for cubics, written out for a number or for lanes of them; knot[0..5] =
// knots[k-2 .. k+3].
template <typename Real>
struct CubicRow {
  Real value[4], first[4], second[4];
};

template <typename Real>
inline CubicRow<Real> cubic_row(const Real (&knot)[6], Real t) {
  // The recurrence raises the degree once a row: every entry is a sum of nonnegative terms inside the span,
  // so nothing cancels. The rows of degree 1 and 2 give the derivatives by differences.
  const Real left1 = t - knot[2], left2 = t - knot[1], left3 = t - knot[0];
  const Real right1 = knot[3] - t, right2 = knot[4] - t, right3 = knot[5] - t;

  const Real inv1 = 1.0 / (knot[3] - knot[2]);
  const Real a0 = right1 * inv1, a1 = left1 * inv1;  // degree 1

  const Real inv20 = 1.0 / (knot[3] - knot[1]), inv21 = 1.0 / (knot[4] - knot[2]);
  const Real q0 = a0 * inv20, q1 = a1 * inv21;
  const Real b0 = right1 * q0, b1 = left2 * q0 + right2 * q1, b2 = left1 * q1;  // degree 2

  const Real inv30 = 1.0 / (knot[3] - knot[0]), inv31 = 1.0 / (knot[4] - knot[1]),
             inv32 = 1.0 / (knot[5] - knot[2]);
  const Real c0 = b0 * inv30, c1 = b1 * inv31, c2 = b2 * inv32;
  // Second derivatives: the first derivatives of the degree-2 row, differenced once more.
  const Real d0 = -2.0 * q0 * inv30, d1 = 2.0 * (q0 - q1) * inv31, d2 = 2.0 * q1 * inv32;

  return {{right1 * c0, left3 * c0 + right2 * c1, left2 * c1 + right3 * c2, left1 * c2},
          {-3.0 * c0, 3.0 * (c0 - c1), 3.0 * (c1 - c2), 3.0 * c2},
          {-3.0 * d0, 3.0 * (d0 - d1), 3.0 * (d1 - d2), 3.0 * d2}};
}

}  // namespace moldloft::geometry
