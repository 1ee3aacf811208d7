// Bernstein polynomials of the two degrees that the surface fit lives on: cubics, and sextics
// for their products.
//
// Accuracy     sums of nonnegative terms throughout: nothing cancels on [0, 1]
// Cost         constant
// Allocation   none
#pragma once

#include <array>

namespace moldloft::geometry {

constexpr std::array<double, 4> binomial3{1, 3, 3, 1};
constexpr std::array<double, 7> binomial6{1, 6, 15, 20, 15, 6, 1};

// B_0^3(t), ..., B_3^3(t) and B_0^6(t), ..., B_6^6(t).
struct BernsteinValues {
  std::array<double, 4> cubic;
  std::array<double, 7> sextic;
};

inline BernsteinValues bernstein(double t) {
  const double s = 1 - t, t2 = t * t, s2 = s * s, t3 = t2 * t, s3 = s2 * s;
  return {{s3, 3 * s2 * t, 3 * s * t2, t3},
          {s3 * s3, 6 * s3 * s2 * t, 15 * s2 * s2 * t2, 20 * s3 * t3, 15 * s2 * t2 * t2, 6 * s * t2 * t3,
           t3 * t3}};
}

// From the Bernstein polynomials of degree k, blossomed at k arguments, to those of degree k + 1 with one
// more argument t (thesis eq. 2.31 with an argument of its own for every step). In place; `row` has room for
// k + 2.
constexpr void raise_bernstein(double* row, int k, double t) {
  row[k + 1] = 0;
  for (int p = k + 1; p > 0; --p) row[p] = (1 - t) * row[p] + t * row[p - 1];
  row[0] = (1 - t) * row[0];
}

// R with B_p^n(a + (b - a) t) = sum_l R[p][l] B_l^n(t) (thesis eq. 3.6): the blossom of B_p^n at n - l
// times a and l times b. restrict_bernstein() of bernstein_form.hpp is the same for a degree known only
// at run time.
template <int degree>
constexpr std::array<std::array<double, degree + 1>, degree + 1> restriction(double a, double b) {
  std::array<std::array<double, degree + 1>, degree + 1> r{};
  for (int l = 0; l <= degree; ++l) {
    std::array<double, degree + 1> row{1};
    for (int k = 0; k < degree; ++k) raise_bernstein(row.data(), k, k < degree - l ? a : b);
    for (int p = 0; p <= degree; ++p) r[p][l] = row[p];
  }
  return r;
}

}  // namespace moldloft::geometry
