// An estimate of |A^-1| in the 1-norm from A's band factor: a few solves, never too large, and within a
// factor of three in practice.
//
// Source       Hager 1984, Higham 1988 (LAPACK's xLACON without its last safeguard)
// Cost         at most ten solves
// Allocation   three vectors of the matrix's size
#pragma once

#include "geometry/splines/band_cholesky.hpp"

#include <Eigen/Core>

#include <cmath>

namespace moldloft::geometry {

inline double estimated_inverse_norm(const BandCholesky& factor) {
  const int n = factor.size();
  const auto solve = [&](Eigen::VectorXd& x) {
    const std::span<double> all{x.data(), static_cast<std::size_t>(n)};
    factor.solve_lower(all, 0, n);
    factor.solve_upper(all, 0, n);
  };
  Eigen::VectorXd x = Eigen::VectorXd::Constant(n, 1.0 / n), y, z;
  double estimate = 0;
  for (int step = 0; step < 5; ++step) {
    y = x;
    solve(y);
    estimate = std::max(estimate, y.lpNorm<1>());
    z = y.unaryExpr([](double value) { return value < 0 ? -1.0 : 1.0; });
    solve(z);
    Eigen::Index at = 0;
    if (z.cwiseAbs().maxCoeff(&at) <= z.dot(x)) break;
    x.setZero();
    x[at] = 1;
  }
  return estimate;
}

}  // namespace moldloft::geometry
