#include "geometry/splines/closed_polygon.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <numbers>
#include <random>
#include <vector>

using namespace moldloft::geometry;
using Eigen::Vector2d;
using Polygon = std::vector<Vector2d>;

namespace {

const Polygon l_shape = {{0, 0}, {4, 0}, {4, 1}, {1, 1}, {1, 3}, {0, 3}};

}  // namespace

TEST_CASE("the area of a polygon is signed, and keeps its digits far from the origin") {
  CHECK(signed_area(l_shape) == 6);
  CHECK(signed_area(Polygon(l_shape.rbegin(), l_shape.rend())) == -6);
  Polygon far = l_shape;
  for (auto& p : far) p += Vector2d(1e9, -1e9);
  CHECK(signed_area(far) == 6);
  CHECK(signed_area(Polygon{{0, 0}, {1, 1}}) == 0);
}

TEST_CASE("points are inside a concave polygon or not, whichever way it runs") {
  const Polygon back(l_shape.rbegin(), l_shape.rend());
  for (const Polygon& polygon : {l_shape, back}) {
    for (int i = -2; i < 22; ++i) {
      for (int j = -2; j < 18; ++j) {
        const double x = 0.21 * i + 0.003, y = 0.19 * j + 0.007;  // never on an edge
        const bool truth = x > 0 && y > 0 && x < 4 && y < 3 && (x < 1 || y < 1);
        CHECK(contains(polygon, {x, y}) == truth);
      }
    }
  }
  CHECK_FALSE(contains(Polygon{{0, 0}, {1, 1}}, {0.5, 0.5}));
}

TEST_CASE("a polygon crosses itself where edges cross, touch, or turn back") {
  CHECK_FALSE(crosses_itself(l_shape));
  CHECK(crosses_itself(Polygon{{0, 0}, {2, 2}, {2, 0}, {0, 2}}));          // a bow tie
  CHECK(crosses_itself(Polygon{{0, 0}, {4, 0}, {4, 4}, {2, 0}, {0, 4}}));  // a corner on an edge
  CHECK(crosses_itself(Polygon{{0, 0}, {4, 0}, {2, 0}, {2, 3}}));          // turns back
  CHECK_FALSE(crosses_itself(Polygon{{0, 0}, {1, 0}, {2, 0}, {2, 1}}));    // straight on is no crossing
  CHECK_FALSE(crosses_itself(Polygon{{0, 0}, {1, 0}, {0, 1}}));            // neighbours all round
}

TEST_CASE("random stars never cross themselves, and always do with two corners exchanged") {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> radius(1, 5);
  for (int trial = 0; trial < 50; ++trial) {
    Polygon star;
    for (int k = 0; k < 20; ++k) {
      const double angle = 2 * std::numbers::pi * k / 20;
      star.push_back(radius(random) * Vector2d(std::cos(angle), std::sin(angle)));
    }
    CHECK_FALSE(crosses_itself(star));
    std::swap(star[3], star[13]);  // both edges at each now pass over the middle
    CHECK(crosses_itself(star));
  }
}

TEST_CASE("two polygons cross or stay apart, one inside the other too") {
  const Polygon inner = {{0.2, 0.2}, {0.8, 0.2}, {0.8, 0.8}};
  CHECK_FALSE(cross(l_shape, inner));
  CHECK(cross(l_shape, Polygon{{0.5, 0.5}, {5, 0.5}, {0.5, 0.9}}));
  CHECK_FALSE(cross(l_shape, Polygon{{5, 5}, {6, 5}, {6, 6}}));
}
