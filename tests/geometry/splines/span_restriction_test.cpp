#include "geometry/splines/span_restriction.hpp"

#include "geometry/splines/bernstein.hpp"
#include "geometry/splines/bspline.hpp"

#include <doctest/doctest.h>

#include <random>

using namespace moldloft::geometry;

TEST_CASE("the middle patch of six by six control points has the thesis's printed coefficients") {
  // Thesis page 45: P33 = 1/16 q11 + 7/48 q12 + 1/24 q13 + 7/48 q21 + 49/144 q22 + 7/72 q23 + ..., the
  // products of (1/4, 7/12, 1/6); P34 and P35 have (2/3, 1/3) and (1/3, 2/3) along v; P36 mirrors P33.
  const std::vector<double> knots{0, 0, 0, 0, 1.0 / 3, 2.0 / 3, 1, 1, 1, 1};
  const Eigen::Matrix4d r = span_restriction(knots, 4, knots[4], knots[5]);
  Eigen::Matrix4d printed;  // row: q1..q4, column: the patch's control point
  printed << 1.0 / 4, 0, 0, 0, 7.0 / 12, 2.0 / 3, 1.0 / 3, 1.0 / 6, 1.0 / 6, 1.0 / 3, 2.0 / 3, 7.0 / 12, 0, 0,
      0, 1.0 / 4;
  CHECK((r - printed).cwiseAbs().maxCoeff() < 4e-16);
}

TEST_CASE("on a part of a span the Bernstein form has the basis's values") {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> unit(0, 1);
  const std::vector<double> knots{0, 0, 0, 0, 0.1, 0.25, 0.25, 0.7, 0.7, 0.7, 0.9, 1, 1, 1, 1};
  for (int trial = 0; trial < 2000; ++trial) {
    const int k = find_span(knots, unit(random));
    const double low = knots[k], h = knots[k + 1] - low;
    const double a = low + h * unit(random), b = low + h * unit(random), s = unit(random);
    const Eigen::Matrix4d r = span_restriction(knots, k, a, b);
    const auto bernstein_values = bernstein(s).cubic;
    const auto basis = cubic_basis(knots, k, a + (b - a) * s).value;
    for (int i = 0; i < 4; ++i) {
      double value = 0;
      for (int l = 0; l < 4; ++l) value += r(i, l) * bernstein_values[l];
      // Both are sums of nonnegative terms; the argument's rounding moves a value by at most 3 / h of itself.
      CHECK(std::abs(value - basis[i]) < 64 * 2.3e-16 / std::min(1.0, h));
    }
    CHECK((r.array() >= 0).all());
    for (int l = 0; l < 4; ++l) CHECK(std::abs(r.col(l).sum() - 1) < 16 * 2.3e-16);
  }
}
