#include "geometry/splines/bspline_basis.hpp"

#include <algorithm>
#include <cassert>

namespace moldloft::geometry {

namespace {

using Row = std::array<double, most_spline_degree + 1>;

// From the q functions of degree q - 1 on span k to the q + 1 functions of degree q (eq. 2.45). Shared with
// the blossom: with another argument at every step this gives the basis's polar values.
void raise_value(std::span<const double> knots, int k, int q, double t, Row& row) {
  row[q] = 0;
  for (int j = q - 1; j >= 0; --j) {  // function j stands on knots[low] .. knots[low + q]
    const int low = k - q + 1 + j;
    const double length = knots[low + q] - knots[low];
    row[j + 1] += (t - knots[low]) / length * row[j];  // the quotient is exactly one where t is a clamped end
    row[j] *= (knots[low + q] - t) / length;
  }
}

// The same step for a derivative: N' of degree q from N of degree q - 1.
void raise_derivative(std::span<const double> knots, int k, int q, Row& row) {
  row[q] = 0;
  for (int j = q - 1; j >= 0; --j) {
    const int low = k - q + 1 + j;
    const double share = q * row[j] / (knots[low + q] - knots[low]);
    row[j + 1] += share;
    row[j] = -share;
  }
}

}  // namespace

BasisValues cubic_basis(std::span<const double> knots, int k, double t) {
  const double knot[6] = {knots[k - 2], knots[k - 1], knots[k], knots[k + 1], knots[k + 2], knots[k + 3]};
  const CubicRow<double> row = cubic_row(knot, t);
  BasisValues basis;
  for (int i = 0; i < 4; ++i)
    basis.value[i] = row.value[i], basis.first[i] = row.first[i], basis.second[i] = row.second[i];
  return basis;
}

void basis_functions(std::span<const double> knots, int degree, int k, double t, std::span<double> values) {
  basis_derivatives(knots, degree, k, t, 0, values);
}

void basis_derivatives(std::span<const double> knots, int degree, int k, double t, int orders,
                       std::span<double> values) {
  const int width = degree + 1;
  assert(degree <= most_spline_degree && values.size() >= static_cast<std::size_t>((orders + 1) * width));
  for (int m = 0; m <= orders; ++m) {
    Row row{1};
    if (m > degree) row[0] = 0;
    for (int q = 1; q <= degree; ++q) {
      if (q <= degree - m)
        raise_value(knots, k, q, t, row);
      else
        raise_derivative(knots, k, q, row);
    }
    std::copy_n(row.begin(), width, values.begin() + m * width);
  }
}

Eigen::MatrixXd piece_extraction(std::span<const double> knots, int degree, int k, double a, double b) {
  assert(degree <= most_spline_degree);
  Eigen::MatrixXd m(degree + 1, degree + 1);
  for (int l = 0; l <= degree; ++l) {  // the basis's polar value at degree - l times a and l times b
    Row row{1};
    for (int q = 1; q <= degree; ++q) raise_value(knots, k, q, q <= degree - l ? a : b, row);
    std::copy_n(row.begin(), degree + 1, m.col(l).data());
  }
  return m;
}

}  // namespace moldloft::geometry
