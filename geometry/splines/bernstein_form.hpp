// Arithmetic of polynomials in Bernstein form, of any degree (thesis section 2.3 and eq. 3.6-3.12).
//
// A form is a matrix with a row for every coefficient, 0..n, and a column for every axis: a polynomial curve
// of degree n = rows - 1 over [0, 1]. Coefficients have any unit; nothing here knows what they measure.
//
// Domain       t, a, b in [0, 1] for the bounds below; outside it the polynomials go on, the bounds
//              do not hold
// Accuracy     relative, for every entry of a basis or a matrix (all are sums of nonnegative terms);
//              times the largest coefficient for what is done to a form. eps is 2^-52.
// Allocation   what is returned
// Failure      none: degrees from 0 to most_bernstein_degree are the caller's duty (asserted)
#pragma once

#include <Eigen/Core>

namespace moldloft::geometry {

// The largest degree, of products and raised forms too: to here every binomial coefficient fits into 64 bits.
constexpr int most_bernstein_degree = 67;

using BernsteinForm = Eigen::MatrixXd;
using FormRef = Eigen::Ref<const Eigen::MatrixXd>;  // an Eigen::VectorXd is a form of one axis

// C(n, k), 0 if k is not in 0..n. Exact to n = 56, beyond that the double nearest to the exact value.
double binomial(int n, int k);

// B_0^n(t) ... B_n^n(t) by the recurrence (eq. 2.31), within 2 n eps, O(n^2); and by the definition (eq.
// 2.27), within (n + 2) eps, O(n).
Eigen::VectorXd bernstein_basis(int degree, double t);
Eigen::VectorXd bernstein_basis_by_definition(int degree, double t);

// Row k: the k-th derivatives of B_0^n ... B_n^n at t, k = 0..orders. Within 2^(k + 1) n!/(n - k)!
// n eps, absolute.
Eigen::MatrixXd bernstein_derivatives(int degree, double t, int orders);

// Bernstein polynomials of degree n restricted to [a, b] of [0, 1] (eq. 3.6).
// Returns R with B_i^n(a + (b - a) t) = sum_l R(i, l) B_l^n(t); rows i, columns l, both 0..n.
// a and b may be in any order. Within 2 n eps. Cost O(n^2) per row.
Eigen::MatrixXd restrict_bernstein(int degree, double a, double b);

// The factor c of B_l^n(t) B_q^m(t) = c B_{l+q}^{n+m}(t) (eq. 3.7), within 3 eps.
double product_factor(int n, int l, int m, int q);

// E, raised + 1 rows and degree + 1 columns, that takes the coefficients of a form of `degree` to those of
// the same polynomial at degree `raised` (eq. 2.39-2.42 all at once, 3.9):
// E(p, j) = C(raised - degree, p - j) C(degree, j) / C(raised, p). Within 3 eps; rows add up to 1.
Eigen::MatrixXd elevation_matrix(int degree, int raised);

// The form's value at t by de Casteljau (eq. 2.34), one entry an axis. Within 2 n eps.
Eigen::RowVectorXd form_at(const FormRef& form, double t);

// The two halves of de Casteljau's triangle: the form on [0, t] and on [t, 1], each over [0, 1] again. Within
// 2 n eps.
struct SplitForm {
  BernsteinForm left, right;
};
SplitForm split_form(const FormRef& form, double t);

// The derivative: degree n - 1 (0 for a constant). Within 2 n eps.
BernsteinForm differentiate_form(const FormRef& form);

// The same polynomial with its degree raised, within (n + 3) eps; on the segment [a, b], within 4 n eps.
BernsteinForm elevate_form(const FormRef& form, int raised);
BernsteinForm restrict_form(const FormRef& form, double a, double b);

// factor(t) form(t), axis by axis; degree is the sum of the degrees (eq. 3.7).
// Within (min(n, m) + 4) eps of the product of the largest coefficients.
BernsteinForm multiply_forms(const Eigen::Ref<const Eigen::VectorXd>& factor, const FormRef& form);

}  // namespace moldloft::geometry
