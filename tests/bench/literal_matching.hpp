// The thesis's program, as section 3.6 prints it: six nested loops that form the matrix of equation
// (3.13) for one stripe, every Bernstein polynomial computed anew where it is needed, by its definition
// (2.27) or by its recurrence (2.31). Slow on purpose: it is what the fast form is held against, in the
// tests and in `moldloft-bench thesis`.
#pragma once

#include <Eigen/Core>

#include <algorithm>
#include <vector>

namespace moldloft::bench {

// Pascal's triangle, once: only the Bernstein polynomials are at stake.
inline double literal_binomial(int n, int i) {
  constexpr int most = 64;
  static const std::vector<double> triangle = [] {
    std::vector<double> c(most * most, 0.0);
    for (int row = 0; row < most; ++row)
      for (int k = 0; k <= row; ++k)
        c[row * most + k] = k == 0 || k == row ? 1 : c[(row - 1) * most + k - 1] + c[(row - 1) * most + k];
    return c;
  }();
  return triangle[n * most + i];
}

struct ByDefinition {  // eq. 2.27
  static double bernstein(int i, int n, double t) {
    double value = literal_binomial(n, i);
    for (int k = 0; k < i; ++k) value *= t;
    for (int k = 0; k < n - i; ++k) value *= 1 - t;
    return value;
  }
};

struct ByRecurrence {  // eq. 2.31: de Casteljau's triangle over the coefficients of the i-th unit vector
  static double bernstein(int i, int n, double t) {
    double row[64] = {};
    row[i] = 1;
    for (int level = 1; level <= n; ++level)
      for (int k = 0; k <= n - level; ++k) row[k] = (1 - t) * row[k] + t * row[k + 1];
    return row[0];
  }
};

// One stripe with the straight pre-image from (ua, va) to (ub, vb): n1 + n2 + 1 rows, column i (n2 + 1) + j.
template <typename Bernstein>
Eigen::MatrixXd literal_rows(int n1, int n2, const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  Eigen::MatrixXd rows = Eigen::MatrixXd::Zero(n1 + n2 + 1, (n1 + 1) * (n2 + 1));
  const int r = n1 + n2;
  for (int i = 0; i <= n1; i++)
    for (int j = 0; j <= n2; j++)
      for (int k = 0; k <= i; k++)
        for (int l = k; l <= n1 - i + k; l++)
          for (int p = 0; p <= j; p++)
            for (int q = p; q <= n2 - j + p; q++) {
              const double w = Bernstein::bernstein(k, l, b.x()) *
                               Bernstein::bernstein(i - k, n1 - l, a.x()) *
                               Bernstein::bernstein(p, q, b.y()) * Bernstein::bernstein(j - p, n2 - q, a.y());
              rows(l + q, i * (n2 + 1) + j) +=
                  literal_binomial(n1, l) * literal_binomial(n2, q) / literal_binomial(r, l + q) * w;
            }
  return rows;
}

// The right side of equation (3.12).
inline Eigen::MatrixX3d literal_side(const Eigen::MatrixX3d& d, int r) {
  const int n3 = static_cast<int>(d.rows()) - 1;
  Eigen::MatrixX3d g = Eigen::MatrixX3d::Zero(r + 1, 3);
  for (int p = 0; p <= r; p++)
    for (int j = std::max(0, p - r + n3); j <= std::min(n3, p); j++)
      g.row(p) +=
          literal_binomial(r - n3, p - j) * literal_binomial(n3, j) / literal_binomial(r, p) * d.row(j);
  return g;
}

}  // namespace moldloft::bench
