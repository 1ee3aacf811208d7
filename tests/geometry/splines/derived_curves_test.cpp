#include "geometry/splines/derived_curves.hpp"

#include "geometry/splines/spline_samples.hpp"

#include <doctest/doctest.h>

using namespace moldloft::geometry;
using samples::eps, samples::exact, samples::Numbers;

namespace {

// The largest p / (support that is divided by).
double steepest(const std::vector<double>& knots, int p) {
  double most = 0;
  for (std::size_t i = 1; i + p + 1 < knots.size(); ++i) most = std::max(most, p / (knots[i + p] - knots[i]));
  return most;
}

}  // namespace

TEST_CASE("the derivative of a curve is a curve of one degree less") {
  Numbers numbers;
  for (int p : {1, 2, 3, 5}) {
    const auto curve = numbers.curve<2>(p, 4);
    const auto first = derivative(curve);
    CHECK(first.degree == p - 1);
    CHECK(first.control.size() + 1 == curve.control.size());
    for (double t = 0.017; t < 1; t += 0.07)
      CHECK(std::abs(exact(first, 0, t) - exact(curve, 0, t, 1)) <= 4 * eps * steepest(curve.knots, p));
  }
}

TEST_CASE("the derivatives of a surface are surfaces") {
  Numbers numbers;
  const BSplineSurface s = numbers.surface(3, 4, 2, 3);
  const BSplineSurface du = derivative_u(s), dv = derivative_v(s);
  CHECK(check(du).has_value());
  CHECK(du.degree_u == 2);
  CHECK(dv.degree_v == 1);
  for (const auto& [u, v] : {std::pair{0.1, 0.93}, {0.42, 0.31}, {0.77, 0.6}}) {
    CHECK(std::abs(exact(du, du.z, u, v) - exact(s, s.z, u, v, 1, 0)) <= 4 * eps * steepest(s.knots_u, 3));
    CHECK(std::abs(exact(dv, dv.x, u, v) - exact(s, s.x, u, v, 0, 1)) <= 4 * eps * steepest(s.knots_v, 2));
  }
}

TEST_CASE("isoparametric lines are curves that lie on the surface") {
  Numbers numbers;
  const BSplineSurface s = numbers.surface(3, 4, 4, 3);
  for (const double c : {0.0, 0.213, 0.5, 0.99, 1.0}) {
    const SpaceCurve along_u = line_along_u(s, c), along_v = line_along_v(s, c);
    CHECK(along_u.degree == 3);
    CHECK(along_v.degree == 4);
    CHECK(check(along_u).has_value());
    for (const double t : {0.0, 0.17, 0.64, 1.0}) {
      CHECK(std::abs(exact(along_u, 2, t) - exact(s, s.z, t, c)) <= 4 * 4 * eps);
      CHECK(std::abs(exact(along_v, 0, t) - exact(s, s.x, c, t)) <= 4 * 3 * eps);
    }
  }
  for (int i = 0; i < s.control_u(); ++i)
    CHECK(line_along_u(s, 0).control[i].z() == s.z(i, 0));  // a boundary curve
  for (int j = 0; j < s.control_v(); ++j)
    CHECK(line_along_v(s, 1).control[j].y() == s.y(s.control_u() - 1, j));
  CHECK(line_along_u(s, 7).control == line_along_u(s, 1).control);
}

TEST_CASE("the derivative across a line is a curve too") {
  Numbers numbers;
  const BSplineSurface s = numbers.surface(3, 4, 3, 3);
  for (const double t : {0.05, 0.38, 0.8}) {
    double along_u = 0;
    for (int i = 0; i < s.control_u(); ++i)
      along_u += static_cast<double>(samples::basis_derivative(s.knots_u, i, 3, 1, 0.3, 1));
    CHECK(std::abs(exact(line_along_v(s, 0.3, 1), 1, t) - exact(s, s.y, 0.3, t, 1, 0)) <=
          4 * 3 * eps * along_u);
    CHECK(std::abs(exact(line_along_v(s, 0.3, 4), 1, t)) == 0);
  }
}
