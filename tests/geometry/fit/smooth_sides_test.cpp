#include "geometry/fit/smooth_sides.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <limits>
#include <numbers>

using namespace moldloft::geometry;
using Eigen::Vector2d;
using Points = std::vector<Vector2d>;

namespace {

Points on_circle(double radius, int n, double sign = 1) {
  Points p;
  for (int k = 0; k < n; ++k) {
    const double angle = sign * 2 * std::numbers::pi * k / n;
    p.push_back({500 + radius * std::cos(angle), 100 + radius * std::sin(angle)});
  }
  return p;
}

}  // namespace

TEST_CASE(
    "a polyline of straight edges becomes as many straight sides at constant speed, counter-clockwise") {
  for (int n : {3, 5, 6}) {
    for (const double sign : {1.0, -1.0}) {
      const auto sides = smooth_sides(on_circle(100, n, sign), 0.5).value();
      REQUIRE(static_cast<int>(sides.size()) == n);
      const double edge = 2 * 100 * std::sin(std::numbers::pi / n);
      for (int i = 0; i < n; ++i) {
        const auto& side = sides[i];
        CHECK(side.control.back() == sides[(i + 1) % n].control.front());
        const Vector2d a = side.control.front(), b = side.control.back();
        CHECK((a - Vector2d(500, 100)).dot(Vector2d(b.y() - a.y(), a.x() - b.x())) >
              0);  // the middle lies left
        CHECK((b - a).norm() == doctest::Approx(edge).epsilon(1e-12));
        for (int k = 0; k <= 10; ++k)
          CHECK((side.at(edge * k / 10).value - (a + (b - a) * k / 10)).norm() < 1e-12);
      }
    }
  }
}

TEST_CASE(
    "points on a circle become one closed side, within the bound of spline interpolation and smooth at the "
    "seam") {
  for (const int n : {32, 64, 128}) {
    const double radius = 150, h = 2 * std::numbers::pi * radius / n;
    const auto sides = smooth_sides(on_circle(radius, n), 0.5).value();
    REQUIRE(sides.size() == 1);
    const auto& c = sides[0];
    CHECK(c.control.size() == static_cast<std::size_t>(n) + 3);
    // Hall and Meyer 1976: 5/384 h^4 max |c''''|, which for an arc is 1 / R^3; 10 % for chord
    // against arc length.
    const double bound = 1.1 * 5.0 / 384 * std::pow(h, 4) / std::pow(radius, 3);
    double worst = 0;
    for (int k = 0; k <= 2000; ++k) {
      const double t = c.knots.back() * k / 2000;
      worst = std::max(worst, std::abs((c.at(t).value - Vector2d(500, 100)).norm() - radius));
    }
    CHECK(worst <= bound);
    const auto start = c.at(0), end = c.at(c.knots.back());
    CHECK((start.first - end.first).norm() < 1e-12);
    CHECK((start.second - end.second).norm() < 1e-12);
  }
}

TEST_CASE("sides between corners follow a cubic exactly, and pass through every point") {
  // A lens: a parabola of unequal steps above, a straight line below.
  Points lens;
  for (const double x : {100.0, 93.0, 71.0, 60.0, 42.0, 20.0, 3.0, 0.0})
    lens.push_back({x, 0.008 * x * (100 - x)});
  const auto sides = smooth_sides(lens, 0.5).value();
  REQUIRE(sides.size() == 2);
  std::size_t found = 0;
  for (const auto& side : sides) {
    for (const double t : side.knots) {
      const Vector2d p = side.at(t).value;
      for (const auto& q : lens) found += (p - q).norm() <= 8 * 2.3e-16 * 100 ? 1 : 0;
    }
  }
  CHECK(found == 2 * 8 + 6);  // clamped ends four times on each side, inner points once
  for (int k = 0; k <= 100; ++k) {
    const auto& side = sides[0].control.size() > sides[1].control.size() ? sides[0] : sides[1];
    const Vector2d p = side.at(side.knots.back() * k / 100).value;
    // Chord-length parameters bend the parabola a little: h^4 / 384 times a few of its fourth derivatives.
    CHECK(std::abs(p.y() - 0.008 * p.x() * (100 - p.x())) < 0.05);
  }
}

TEST_CASE("four points of a cubic over equal chords give that cubic") {
  // Not-a-knot through four points leaves one cubic: Lagrange's.
  Points arc = {{0, 0}, {1, 0.4}, {2, 0.4}, {3, 0}};
  arc.push_back({1.5, 9});  // closes it, with corners at both ends
  const auto sides = smooth_sides(arc, 0.9).value();
  REQUIRE(sides.size() == 3);
  const PlanCurve* bow = nullptr;
  for (const auto& side : sides) {
    if (side.control.size() == 6) bow = &side;
  }
  REQUIRE(bow != nullptr);
  const std::array<double, 4> t = {0, std::hypot(1, 0.4), std::hypot(1, 0.4) + 1, 2 * std::hypot(1, 0.4) + 1};
  for (int k = 0; k <= 20; ++k) {
    const double s = t[3] * k / 20;
    Vector2d lagrange = Vector2d::Zero();
    for (int i = 0; i < 4; ++i) {
      double weight = 1;
      for (int j = 0; j < 4; ++j) {
        if (j != i) weight *= (s - t[j]) / (t[i] - t[j]);
      }
      lagrange += weight * arc[i];
    }
    CHECK((bow->at(s).value - lagrange).norm() < 1e-13);
  }
}

TEST_CASE("repeated points and a closing point are one, and too few or bad points are named") {
  const Points triangle = {{0, 0}, {0, 0}, {10, 0}, {10, 0}, {5, 8}, {0, 0}};
  CHECK(smooth_sides(triangle, 0.5).value().size() == 3);
  CHECK(smooth_sides(Points{{0, 0}, {1, 1}, {0, 0}, {0, 0}}, 0.5).error() == Error::too_few_points);
  CHECK(smooth_sides(Points{}, 0.5).error() == Error::too_few_points);
  CHECK(smooth_sides(Points{{0, 0}, {1, std::numeric_limits<double>::quiet_NaN()}, {2, 2}}, 0.5).error() ==
        Error::not_finite);
}
