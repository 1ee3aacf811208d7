// Cubic B-spline basis functions on a part of one knot span, in Bernstein form: what knot insertion
// to multiplicity three (thesis eq. 3.20-3.33) and restriction to a segment (eq. 3.6) give together,
// in one step.
//
// Source       the blossom of a basis function at 3 - l times a and l times b (Ramshaw 1987)
// Accuracy     for a, b in the span every entry is a sum of nonnegative terms: relative error <= 32 eps
// Cost         6 divisions and some 100 multiplications
// Allocation   none
#pragma once

#include <Eigen/Core>

#include <span>

namespace moldloft::geometry {

// R with N_{k-3+i}(a + (b - a) s) = sum_l R(i, l) B_l^3(s), for span k = find_span() of the knots. a and b in
// any order; beyond the span it is the same polynomials.
Eigen::Matrix4d span_restriction(std::span<const double> knots, int k, double a, double b);

}  // namespace moldloft::geometry
