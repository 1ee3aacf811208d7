// Curve on a surface: the equations that say a stripe lies on a surface along the straight pre-image from
// `from` to `to` of the unit square, one for each Bernstein coefficient in t (thesis eq. 3.5-3.13).
//
// Method       each basis in u and v is restricted to the pre-image's interval (eq. 3.6), the two are
//              multiplied with their binomials (eq. 3.7): the thesis's six nested loops without
//              computing anything twice
// Shapes       rows: degree_u + degree_v + 1; columns: control point (i, j) at i (degree_v + 1) + j
// Accuracy     entries are sums of nonnegative terms: within 4 (degree_u + degree_v) eps of themselves
//              inside [0, 1]
// Cost         (degree_u + 1)^2 (degree_v + 1)^2 multiply-adds a stripe
// Allocation   the matrices that are returned, and the two restrictions; none in the bicubic form
#pragma once

#include <Eigen/Core>

namespace moldloft::geometry {

// Fills `rows`, (degree_u + degree_v + 1) x (degree_u + 1)(degree_v + 1).
void fill_matching_rows(int degree_u, int degree_v, const Eigen::Vector2d& from, const Eigen::Vector2d& to,
                        Eigen::Ref<Eigen::MatrixXd> rows);

// The right side g of the stripe, its degree raised to degree_u + degree_v (eq. 3.9, 3.12): a
// row a coefficient.
Eigen::MatrixX3d matching_side(const Eigen::MatrixX3d& stripe_control, int raised_degree);

// The same for a piece of a bicubic B-spline's cell, transposed: column p is equation p, basis
// function (i, j) of the cell at 4 i + j. `along_u` and `along_v` are the bases on the piece in
// Bernstein form (span_restriction).
using BicubicRows = Eigen::Matrix<double, 16, 7>;
BicubicRows bicubic_rows(const Eigen::Matrix4d& along_u, const Eigen::Matrix4d& along_v);

// A cubic's coefficients raised to degree 6.
using SexticSide = Eigen::Matrix<double, 7, 3>;
SexticSide sextic_side(const Eigen::Matrix<double, 4, 3>& cubic_control);

}  // namespace moldloft::geometry
