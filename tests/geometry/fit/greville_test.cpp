// Surfaces through values at their Greville places.
#include "geometry/fit/greville.hpp"

#include <doctest/doctest.h>

#include <cmath>

using namespace moldloft::geometry;

TEST_CASE("a cubic formula comes back exactly, a wave as the fourth power of the span") {
  const auto knots = [](int spans) {
    std::vector<double> k(4, 0.0);
    for (int i = 1; i < spans; ++i) k.push_back(static_cast<double>(i) / spans);
    k.insert(k.end(), 4, 1.0);
    return k;
  };
  const auto off = [&](int spans, auto&& height) {
    const auto u = knots(spans), v = knots(spans + 1);
    const auto at_u = greville_places(u), at_v = greville_places(v);
    Eigen::MatrixXd x(at_u.size(), at_v.size()), y = x, z = x;
    for (Eigen::Index i = 0; i < x.rows(); ++i) {
      for (Eigen::Index k = 0; k < x.cols(); ++k) {
        x(i, k) = at_u[static_cast<std::size_t>(i)], y(i, k) = at_v[static_cast<std::size_t>(k)];
        z(i, k) = height(x(i, k), y(i, k));
      }
    }
    const auto s = surface_through(u, v, x, y, z);
    double most = 0;
    for (int i = 0; i <= 33; ++i) {
      for (int k = 0; k <= 33; ++k) {
        const Eigen::Vector3d p = s.at(i / 33.0, k / 33.0).value;
        most = std::max({most, std::abs(p.x() - i / 33.0), std::abs(p.z() - height(p.x(), p.y()))});
      }
    }
    return most;
  };
  CHECK(off(5, [](double a, double b) { return 3 * a * a * a - a * b * b + b; }) < 1e-13);
  const auto wave = [](double a, double b) { return std::sin(9 * a) * std::cos(7 * b); };
  const double coarse = off(10, wave), fine = off(20, wave);
  CHECK(coarse < 3e-3);
  CHECK(fine < coarse / 12);
}
