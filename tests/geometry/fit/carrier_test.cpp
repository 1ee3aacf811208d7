#include "geometry/fit/carrier.hpp"

#include "geometry/cad/face_quadrature.hpp"
#include "geometry/fit/plates_on_carriers.hpp"
#include "geometry/outline_shapes.hpp"
#include "geometry/splines/closed_polygon.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>

using namespace moldloft;
using namespace moldloft::geometry;
using Eigen::Vector2d, Eigen::Vector3d;
using Points = std::vector<Vector2d>;

namespace {

constexpr double pi = std::numbers::pi;

void check_that_trim_is_outline(const Carrier& carrier, const std::vector<PlanCurve>& sides) {
  const PlanMap map(carrier.outline);
  REQUIRE(map.check().has_value());
  REQUIRE(carrier.trim.size() == sides.size());
  for (std::size_t i = 0; i < sides.size(); ++i) {
    const double a = sides[i].knots.front(), b = sides[i].knots.back();
    for (int k = 0; k <= 50; ++k) {
      const double t = a + (b - a) * k / 50;
      const Vector2d uv = carrier.trim[i].path.at(t).value;
      CHECK((map.at(uv.x(), uv.y()).value - sides[i].at(t).value).norm() < 1e-9);
      CHECK(uv.minCoeff() >= 0);
      CHECK(uv.maxCoeff() <= 1);
    }
  }
}

double rectangle_area(const Carrier& c) {
  return (c.outline.corners[1] - c.outline.corners[0]).norm() *
         (c.outline.corners[3] - c.outline.corners[0]).norm();
}

}  // namespace

TEST_CASE("the carrier of a turned rectangle is that rectangle, with u along the direction nearest to x") {
  for (const double angle : {0.0, 0.3, 1.2, 2.5, -0.7}) {
    const Eigen::Rotation2Dd turn(angle);
    Points box = {{0, 0}, {200, 0}, {200, 80}, {0, 80}};
    for (auto& p : box) p = turn * p + Vector2d(900, -300);
    const auto carrier = carrier_of(box).value();
    CHECK(rectangle_area(carrier) == doctest::Approx(16000).epsilon(1e-8));
    CHECK(carrier.covered == doctest::Approx(1).epsilon(1e-8));
    const Vector2d u = (carrier.outline.corners[1] - carrier.outline.corners[0]).normalized();
    CHECK(u.x() >= std::abs(u.y()) - 1e-12);
    for (const auto& corner : box) {  // every corner of the one is one of the other
      double nearest = 1e9;
      for (const auto& other : carrier.outline.corners) nearest = std::min(nearest, (corner - other).norm());
      CHECK(nearest < 1e-6);
    }
  }
}

TEST_CASE("hexagon, pentagon, triangle and disk have the least rectangle that is known for them") {
  const auto polygon = [](int n) {
    Points p;
    for (int k = 0; k < n; ++k)
      p.push_back(100 * Vector2d(std::cos(2 * pi * k / n + 0.2), std::sin(2 * pi * k / n + 0.2)));
    return p;
  };
  // Hexagon of side 100: a side's length plus twice its half by the height over opposite sides.
  const auto hexagon = carrier_of(polygon(6)).value();
  CHECK(rectangle_area(hexagon) == doctest::Approx(200 * 100 * std::sqrt(3.0)).epsilon(1e-7));
  CHECK(hexagon.covered == doctest::Approx(0.75).epsilon(1e-7));
  CHECK(hexagon.trim.size() == 6);
  // A triangle covers half of its least rectangle, whichever side it stands on.
  CHECK(carrier_of(polygon(3)).value().covered == doctest::Approx(0.5).epsilon(1e-7));
  // A pentagon on its side: the diagonal's length by the height.
  const double diagonal = 200 * std::sin(2 * pi / 5), height = 100 + 100 * std::cos(pi / 5);
  CHECK(rectangle_area(carrier_of(polygon(5)).value()) == doctest::Approx(diagonal * height).epsilon(1e-7));
  // A disk: its diameter both ways. 64 points, interpolation error 5/384 h^4 / R^3 = 1.3e-6 R.
  const auto disk = carrier_of(polygon(64)).value();
  CHECK(disk.trim.size() == 1);
  CHECK(std::abs(rectangle_area(disk) - 200 * 200) <= 2 * 200 * 2 * 100 * 1.3e-6);
  // The chords of inside() lie within 1e-3 mm of the circle: by two thirds of that on average,
  // over its circumference.
  CHECK(std::abs(disk.covered - pi / 4) <= 1e-3 * 2 * pi * 100 / 40000 + 1e-5);
}

TEST_CASE("the rectangle holds curved sides to the last bit and is no larger than they are") {
  const Points corners = {{0, 0}, {300, 40}, {250, 260}, {-40, 200}, {-80, 60}};
  std::vector<PlanCurve> sides;
  for (std::size_t i = 0; i < 5; ++i) {
    const Vector2d a = corners[i], b = corners[(i + 1) % 5], d = b - a,
                   right = Vector2d(d.y(), -d.x()).normalized();
    sides.push_back({uniform_clamped_knots(1), {a, a + d / 3 + 12 * right, a + 2 * d / 3 + 9 * right, b}});
  }
  const auto carrier = carrier_of(sides).value();
  check_that_trim_is_outline(carrier, sides);
  double low_u = 1, high_u = 0, low_v = 1, high_v = 0;
  for (const auto& curve : carrier.trim) {
    for (int k = 0; k <= 20000; ++k) {
      const Vector2d uv = curve.path.at(k / 20000.0).value;
      low_u = std::min(low_u, uv.x()), high_u = std::max(high_u, uv.x());
      low_v = std::min(low_v, uv.y()), high_v = std::max(high_v, uv.y());
    }
  }
  // Between two of the 20,000 places a parabola rises by its sagitta: some 1e-9 of a side.
  CHECK(low_u <= 1e-8);
  CHECK(low_v <= 1e-8);
  CHECK(high_u >= 1 - 1e-8);
  CHECK(high_v >= 1 - 1e-8);

  const auto roomy = carrier_of(sides, {.margin_mm = 5}).value();
  CHECK((roomy.outline.corners[0] - carrier.outline.corners[0]).norm() ==
        doctest::Approx(5 * std::sqrt(2)).epsilon(1e-6));
}

TEST_CASE("no direction that was tried gives a smaller rectangle") {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> radius(60, 140);
  for (int trial = 0; trial < 20; ++trial) {
    Points star;
    for (int k = 0; k < 9; ++k)
      star.push_back(radius(random) * Vector2d(std::cos(2 * pi * k / 9), std::sin(2 * pi * k / 9)));
    const double found = rectangle_area(carrier_of(star, {.corner_angle = 0}).value());
    double least = 1e30;
    for (int k = 0; k < 5000; ++k) {
      const Vector2d d(std::cos(pi / 2 * k / 5000), std::sin(pi / 2 * k / 5000)), e(-d.y(), d.x());
      double a = 1e9, b = -1e9, c = 1e9, f = -1e9;
      for (const auto& p : star) {
        a = std::min(a, d.dot(p)), b = std::max(b, d.dot(p));
        c = std::min(c, e.dot(p)), f = std::max(f, e.dot(p));
      }
      least = std::min(least, (b - a) * (f - c));
    }
    CHECK(found <= least * (1 + 1e-8));
    CHECK(found >= least * (1 - 1e-3));  // the grid of directions is no finer
  }
}

TEST_CASE("an outline that runs clockwise gives the same carrier, and inside is inside") {
  Points l_shape = {{0, 0}, {400, 0}, {400, 100}, {100, 100}, {100, 300}, {0, 300}};
  const auto carrier = carrier_of(l_shape).value();
  std::ranges::reverse(l_shape);
  const auto back = carrier_of(l_shape).value();
  for (std::size_t i = 0; i < 4; ++i)
    CHECK((carrier.outline.corners[i] - back.outline.corners[i]).norm() < 1e-9);
  CHECK(back.covered == doctest::Approx(60000.0 / 120000).epsilon(1e-6));
  for (const auto& c : {carrier, back}) {
    CHECK(c.inside({50, 250}));
    CHECK(c.inside({350, 50}));
    CHECK_FALSE(c.inside({200, 200}));
    CHECK_FALSE(c.inside({-1, 50}));
    CHECK(signed_area(chords(c.trim)) > 0);
  }
}

TEST_CASE("what is wrong with an outline is told by its name") {
  const auto fault = [](const Points& p) { return carrier_of(p).error(); };
  CHECK(fault({{0, 0}, {1, 1}}) == Error::too_few_points);
  CHECK(fault({{0, 0}, {100, 0}, {50, std::numeric_limits<double>::infinity()}}) == Error::not_finite);
  CHECK(fault({{0, 0}, {100, 100}, {200, 200}, {50, 50}}) == Error::collinear);
  CHECK(fault({{0, 0}, {100, 100}, {100, 0}, {0, 100}}) == Error::self_crossing);
  const auto side = [](const Vector2d& a, const Vector2d& b) {
    return PlanCurve{uniform_clamped_knots(1), {a, a + (b - a) / 3, b - (b - a) / 3, b}};
  };
  std::vector<PlanCurve> sides = {side({0, 0}, {10, 0}), side({10, 0}, {5, 8}), side({5, 8}, {0, 0})};
  CHECK(carrier_of(sides).has_value());
  sides[1].control.back().x() += 1e-3;
  CHECK(carrier_of(sides).error() == Error::open_loop);
  sides[1].knots.front() = -1;
  CHECK(carrier_of(sides).error() == Error::knots_not_increasing);
  sides[0].control.resize(3);
  CHECK(carrier_of(sides).error() == Error::too_few_points);
  CHECK(carrier_of(std::span<const PlanCurve>{}).error() == Error::too_few_points);
}

TEST_CASE("a hexagonal and a round plate are fitted over their carriers as truly as their noise allows") {
  for (const auto& plate : {test::hexagonal_plate(), test::round_plate()}) {
    CAPTURE(plate.name);
    const auto fitted = test::fitted_on_carrier(plate);
    REQUIRE(check(fitted.face, 1e-5).has_value());
    // Twice the noise of a fit, for what cross-validation leaves of the shape itself.
    CHECK(fitted.rms_mm <= 2 * fitted.noise_mm);
    CHECK(fitted.report.points_off == 0);
    const auto area = test::area_of(fitted.face);
    CHECK(std::abs(area.value - plate.area_mm2) <= area.error + fitted.area_bound(plate));
  }
}
