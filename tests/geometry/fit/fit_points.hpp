// Scattered heights and the slow, dense solution of their least-squares fit, for tests of the fast one.
#pragma once

#include "geometry/fit/point_columns.hpp"
#include "geometry/splines/bspline.hpp"

#include <Eigen/QR>

#include <random>
#include <vector>

namespace moldloft::test {

struct FitPoints {
  std::vector<double> u, v, z, w;
  geometry::PointColumns columns() const { return {.u = u, .v = v, .z = z}; }
  geometry::PointColumns weighted() const { return {.u = u, .v = v, .z = z, .weight = w}; }
  geometry::PointColumns part(std::size_t first, std::size_t end) const {
    const std::size_t n = end - first;
    return {.u = {&u[first], n}, .v = {&v[first], n}, .z = {&z[first], n}, .weight = {&w[first], n}};
  }
};

template <typename Height>
FitPoints fit_points(int count, unsigned seed, double noise, Height&& height) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> unit(0, 1);
  std::normal_distribution<double> gauss(0, 1);
  FitPoints p;
  for (int i = 0; i < count; ++i) {
    p.u.push_back(unit(random)), p.v.push_back(unit(random)), p.w.push_back(0.2 + unit(random));
    p.z.push_back(height(p.u.back(), p.v.back()) + noise * gauss(random));
  }
  return p;
}

// One row of basis values, v running fastest.
inline Eigen::VectorXd basis_row(const std::vector<double>& ku, const std::vector<double>& kv, double u,
                                 double v) {
  const auto nu = static_cast<Eigen::Index>(ku.size()) - 4, nv = static_cast<Eigen::Index>(kv.size()) - 4;
  Eigen::VectorXd row = Eigen::VectorXd::Zero(nu * nv);
  const int a = geometry::find_span(ku, u), b = geometry::find_span(kv, v);
  const auto bu = geometry::cubic_basis(ku, a, u), bv = geometry::cubic_basis(kv, b, v);
  for (int i = 0; i < 4; ++i) {
    for (int j = 0; j < 4; ++j) row[(a - 3 + i) * nv + b - 3 + j] = bu.value[i] * bv.value[j];
  }
  return row;
}

// By Householder QR of all rows: no normal equations, nothing in common with the code under test.
inline Eigen::VectorXd dense_solution(const FitPoints& p, const std::vector<double>& ku,
                                      const std::vector<double>& kv, bool weighted) {
  const auto rows = static_cast<Eigen::Index>(p.u.size());
  Eigen::MatrixXd a(rows,
                    (static_cast<Eigen::Index>(ku.size()) - 4) * (static_cast<Eigen::Index>(kv.size()) - 4));
  Eigen::VectorXd b(rows);
  for (Eigen::Index i = 0; i < rows; ++i) {
    const auto k = static_cast<std::size_t>(i);
    const double root = weighted ? std::sqrt(p.w[k]) : 1;
    a.row(i) = root * basis_row(ku, kv, p.u[k], p.v[k]);
    b[i] = root * p.z[k];
  }
  return a.householderQr().solve(b);
}

inline double largest_difference(const geometry::BSplineSurface& s, const Eigen::VectorXd& dense) {
  double worst = 0;
  for (int i = 0; i < s.control_u(); ++i) {
    for (int j = 0; j < s.control_v(); ++j) {
      worst = std::max(worst, std::abs(s.z(i, j) - dense[i * s.control_v() + j]));
    }
  }
  return worst;
}

}  // namespace moldloft::test
