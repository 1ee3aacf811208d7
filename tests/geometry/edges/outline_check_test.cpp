#include "geometry/edges/outline_check.hpp"

#include "geometry/heap_watch.hpp"
#include "geometry/outline_shapes.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <limits>
#include <numbers>

using namespace moldloft;
using namespace moldloft::geometry;
using Eigen::Vector2d;
using test::seen;
using Kind = OutlineDeviation::Kind;

namespace {

// 400 x 300 mm, a corner at the origin.
const std::array<Vector2d, 4> rectangle{Vector2d(0, 0), {400, 0}, {400, 300}, {0, 300}};

std::vector<OutlineDeviation> check(const std::vector<Vector2d>& points,
                                    const Outline& outline = test::straight_outline(rectangle)) {
  const auto named = check_outline(outline, points);
  REQUIRE(named.has_value());
  return *named;
}

// The rectangle with its corner (400, 300) gone along an arc of this radius.
std::vector<Vector2d> rounded(double radius) {
  std::vector<Vector2d> border{{0, 0}, {400, 0}};
  for (int i = 0; i <= 40; ++i) {
    const double angle = std::numbers::pi / 2 * i / 40;
    border.emplace_back(400 - radius + radius * std::cos(angle), 300 - radius + radius * std::sin(angle));
  }
  border.emplace_back(0, 300);
  return border;
}

}  // namespace

TEST_CASE("an outline that all edge points lie on has nothing to name") {
  for (unsigned seed = 1; seed <= 20; ++seed)
    CHECK(check(seen({rectangle.begin(), rectangle.end()}, 0.1, seed)).empty());
  const Outline bent = test::bent_outline();
  std::vector<Vector2d> border;
  for (const PlanCurve& side : bent.sides)
    for (int i = 0; i < 100; ++i) border.push_back(side.value(i / 100.0));
  CHECK(check(seen(border), bent).empty());
}

TEST_CASE("a corner that is cut is named with what is gone of both sides") {
  for (const double cut : {5.0, 10.0, 25.0, 80.0}) {
    CAPTURE(cut);
    const auto named = check(seen({{0, 0}, {400, 0}, {400, 300 - cut}, {400 - cut, 300}, {0, 300}}));
    REQUIRE(named.size() == 1);
    CHECK(named[0].kind == Kind::corner_cut);
    CHECK((named[0].place - Vector2d(400, 300)).norm() < 1e-9);
    CHECK(std::abs(named[0].leg_before_mm - cut) < 3);
    CHECK(std::abs(named[0].leg_after_mm - cut) < 3);
    CHECK(std::abs(named[0].inwards_mm - cut / 2) < 1);
    CHECK(named[0].outwards_mm == 0);
  }
  const auto uneven = check(seen({{0, 0}, {400, 0}, {400, 240}, {375, 300}, {0, 300}}));
  REQUIRE(uneven.size() == 1);
  CHECK(uneven[0].kind == Kind::corner_cut);
  CHECK(std::abs(uneven[0].leg_before_mm - 60) < 3);
  CHECK(std::abs(uneven[0].leg_after_mm - 25) < 3);
}

TEST_CASE("a corner that is rounded is named with its radius") {
  for (const double radius : {5.0, 10.0, 20.0, 40.0, 60.0}) {
    CAPTURE(radius);
    const auto named = check(seen(rounded(radius)));
    REQUIRE(named.size() == 1);
    CHECK(named[0].kind == Kind::corner_rounded);
    CHECK((named[0].place - Vector2d(400, 300)).norm() < 1e-9);
    CHECK(std::abs(named[0].radius_mm - radius) < 1 + 0.05 * radius);
  }
}

TEST_CASE("a piece out of a corner is named as one that is missing") {
  const auto named = check(seen({{0, 0}, {400, 0}, {400, 240}, {340, 240}, {340, 300}, {0, 300}}));
  REQUIRE(named.size() == 1);
  CHECK(named[0].kind == Kind::corner_missing);
  CHECK(std::abs(named[0].leg_before_mm - 60) < 3);
  CHECK(std::abs(named[0].leg_after_mm - 60) < 3);
  CHECK(std::abs(named[0].inwards_mm - 60) < 1);
}

TEST_CASE("a notch and a tongue are steps in their side, with depth, length and place") {
  const auto notch =
      check(seen({{0, 0}, {150, 0}, {150, 40}, {250, 40}, {250, 0}, {400, 0}, {400, 300}, {0, 300}}));
  REQUIRE(notch.size() == 1);
  CHECK(notch[0].kind == Kind::step);
  CHECK(notch[0].side == 0);
  CHECK(std::abs(notch[0].inwards_mm - 40) < 0.5);
  CHECK(std::abs(notch[0].length_mm - 100) < 5);
  CHECK(std::abs(notch[0].place.x() - 200) < 5);
  const auto tongue =
      check(seen({{0, 0}, {400, 0}, {400, 100}, {406, 100}, {406, 130}, {400, 130}, {400, 300}, {0, 300}}));
  REQUIRE(tongue.size() == 1);
  CHECK(tongue[0].kind == Kind::step);
  CHECK(tongue[0].side == 1);
  CHECK(tongue[0].inwards_mm == 0);
  CHECK(std::abs(tongue[0].outwards_mm - 6) < 0.5);
}

TEST_CASE("teeth along a side are one ragged rim") {
  std::vector<Vector2d> border{{0, 0}};
  for (int tooth = 0; tooth < 8; ++tooth) {
    border.emplace_back(40 + 40 * tooth, 0);
    border.emplace_back(50 + 40 * tooth, 8);
    border.emplace_back(60 + 40 * tooth, 0);
  }
  border.insert(border.end(), {{400, 0}, {400, 300}, {0, 300}});
  const auto named = check(seen(border));
  REQUIRE(named.size() == 1);
  CHECK(named[0].kind == Kind::ragged);
  CHECK(named[0].side == 0);
  CHECK(std::abs(named[0].inwards_mm - 8) < 1);
  CHECK(std::abs(named[0].length_mm - 300) < 10);
}

TEST_CASE("a part of the outline that nobody saw is named, one false point is not") {
  std::vector<Vector2d> points = seen({rectangle.begin(), rectangle.end()});
  points.emplace_back(100, 30);
  points.emplace_back(399, 100);
  CHECK(check(points).empty());
  std::erase_if(points, [](const Vector2d& p) { return p.y() > 299 && p.x() > 100 && p.x() < 140; });
  const auto named = check(points);
  REQUIRE(named.size() == 1);
  CHECK(named[0].kind == Kind::unseen);
  CHECK(named[0].side == 2);
  CHECK((named[0].place - Vector2d(120, 300)).norm() < 5);
  CHECK(std::abs(named[0].length_mm - 40) < 5);
}

TEST_CASE("a corner that nobody saw is named with how near the edge was seen") {
  std::vector<Vector2d> points = seen({rectangle.begin(), rectangle.end()});
  std::erase_if(points, [](const Vector2d& p) { return (p - Vector2d(400, 300)).norm() < 6; });
  const auto named = check(points);
  REQUIRE(named.size() == 1);
  CHECK(named[0].kind == Kind::corner_unseen);
  CHECK((named[0].place - Vector2d(400, 300)).norm() < 1e-9);
  CHECK(named[0].leg_after_mm > 6);
  CHECK(named[0].leg_after_mm < 7.5);
}

TEST_CASE("a hole beside a side that is seen lies apart") {
  std::vector<Vector2d> points = seen({rectangle.begin(), rectangle.end()});
  for (const Vector2d& p : seen({{190, 30}, {210, 30}, {210, 50}, {190, 50}})) points.push_back(p);
  const auto named = check(points);
  REQUIRE(named.size() == 1);
  CHECK(named[0].kind == Kind::apart);
  CHECK(named[0].side == 0);
  CHECK(std::abs(named[0].inwards_mm - 50) < 0.5);
  CHECK((named[0].place - Vector2d(200, 40)).norm() < 3);
}

TEST_CASE("a miss across the place where the boundary begins is one") {
  // The first corner is where the stations begin and end.
  const auto named = check(seen({{30, 0}, {400, 0}, {400, 300}, {0, 300}, {0, 30}}));
  REQUIRE(named.size() == 1);
  CHECK(named[0].kind == Kind::corner_cut);
  CHECK(named[0].place.norm() < 1e-9);
  CHECK(std::abs(named[0].leg_before_mm - 30) < 3);
  CHECK(std::abs(named[0].leg_after_mm - 30) < 3);
}

TEST_CASE("checking an outline takes bounded steps and no heap") {
  const std::vector<Vector2d> points = seen(rounded(40));
  const Outline outline = test::straight_outline(rectangle);
  OutlineCheck check(points.size());
  const std::size_t before = test::allocations();
  REQUIRE(check.begin(outline, points, {}).has_value());
  std::size_t steps = 1;
  while (!check.step()) ++steps;
  CHECK(test::allocations() == before);
  CHECK(steps >= points.size() / 128);
  CHECK(steps < 400);
  CHECK(check.deviations().size() == 1);
}

TEST_CASE("more points than planned, sides without length and numbers that are none are refused") {
  const std::vector<Vector2d> points = seen({rectangle.begin(), rectangle.end()});
  Outline outline = test::straight_outline(rectangle);
  OutlineCheck small(10);
  CHECK(small.begin(outline, points, {}).error() == Error::capacity);
  CHECK(small.step());
  CHECK(check_outline(Outline{}, points).error() == Error::not_finite);
  outline.sides[1].control[2].x() = std::numeric_limits<double>::quiet_NaN();
  CHECK(check_outline(outline, points).error() == Error::not_finite);
  outline = test::straight_outline({Vector2d(0, 0), {0, 0}, {400, 300}, {0, 300}});
  CHECK(check_outline(outline, points).error() == Error::no_extent);
  // A bad point among good ones is left out; no point at all is an outline that nobody saw.
  std::vector<Vector2d> one_bad = points;
  one_bad[7].x() = std::numeric_limits<double>::quiet_NaN();
  CHECK(check(one_bad).empty());
  const auto nothing = check(std::vector<Vector2d>{});
  REQUIRE(nothing.size() == 1);
  CHECK(nothing[0].kind == Kind::unseen);
  CHECK(std::abs(nothing[0].length_mm - 1400) < 5);
}
