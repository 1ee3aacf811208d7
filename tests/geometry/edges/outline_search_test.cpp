#include "geometry/edges/outline_search.hpp"

#include "geometry/heap_watch.hpp"
#include "geometry/outline_shapes.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <random>

using namespace moldloft;
using namespace moldloft::geometry;
using Eigen::Vector2d;
using Kind = OutlineDeviation::Kind;
using Border = std::vector<Vector2d>;

namespace {

constexpr double pi = std::numbers::pi;

Border turned(Border border, double angle) {
  for (Vector2d& p : border) p = Eigen::Rotation2Dd(angle) * p + Vector2d(1200, -40);
  return border;
}

// What a tracker takes for corners: every corner of the border that turns by more than 15 degrees, millimetres off.
std::vector<Vector2d> candidates(const Border& border, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> off(-3, 3);
  std::vector<Vector2d> found;
  for (std::size_t i = 0; i < border.size(); ++i) {
    const Vector2d in = border[i] - border[(i + border.size() - 1) % border.size()],
                   out = border[(i + 1) % border.size()] - border[i];
    if (in.dot(out) < std::cos(0.26) * in.norm() * out.norm())
      found.push_back(border[i] + Vector2d(off(random), off(random)));
  }
  return found;
}

struct Found {
  std::vector<Vector2d> points, tracked;
  OutlineSearch search;
  std::expected<bool, Error> result;
  explicit Found(const Border& border, std::vector<Vector2d> tracker, unsigned seed = 1)
      : points{test::seen(border, 0.05, seed)},
        tracked{std::move(tracker)},
        search{points.size(), {}, {}, {}},
        result{false} {
    search.begin(points, tracked);
    for (int i = 0; i < 200'000 && result && !*result; ++i) result = search.step();
  }
  explicit Found(const Border& border, unsigned seed = 1) : Found{border, candidates(border, seed), seed} {}
};

double nearest(std::span<const Vector2d> points, const Vector2d& p) {
  double least = std::numeric_limits<double>::infinity();
  for (const Vector2d& q : points) least = std::min(least, (p - q).norm());
  return least;
}

Border rectangle(double width, double depth) { return {{0, 0}, {width, 0}, {width, depth}, {0, depth}}; }

Border regular(int corners, double radius) {
  Border border;
  for (int i = 0; i < corners; ++i)
    border.emplace_back(radius * std::cos(2 * pi * i / corners), radius * std::sin(2 * pi * i / corners));
  return border;
}

// 400 x 300 mm, all corners arcs.
Border rounded(double radius) {
  Border border;
  for (int corner = 0; corner < 4; ++corner) {
    const Vector2d middle(corner == 0 || corner == 3 ? radius : 400 - radius,
                          corner < 2 ? radius : 300 - radius);
    for (int i = 0; i <= 30; ++i) {
      const double angle = pi + pi / 2 * (corner + i / 30.0);
      border.emplace_back(middle + radius * Vector2d(std::cos(angle), std::sin(angle)));
    }
  }
  return border;
}

}  // namespace

TEST_CASE("plates with four sides from 40 mm on have an outline, turned by any angle") {
  const std::vector<Border> plates{rectangle(40, 40),
                                   rectangle(100, 100),
                                   rectangle(60, 400),
                                   rectangle(40, 300),
                                   rectangle(50, 80),
                                   rectangle(75, 105),
                                   rectangle(400, 300),
                                   {{0, 0}, {200, 0}, {130, 150}, {70, 150}},
                                   {{0, 0}, {90, 0}, {65, 60}, {25, 60}},
                                   {{0, 0}, {150, 0}, {190, 45}, {40, 45}},
                                   {{0, 0}, {600, 20}, {590, 70}, {-10, 60}}};
  for (const Border& plate : plates) {
    for (int turn = 0; turn < 12; ++turn) {
      const Border border = turned(plate, 0.55 * turn);
      const Found found(border, static_cast<unsigned>(turn + 1));
      CAPTURE(plate[1].x());
      CAPTURE(plate[2].y());
      CAPTURE(turn);
      REQUIRE(found.result.has_value());
      CHECK(found.search.deviations().empty());
      for (const Vector2d& corner : border) CHECK(nearest(found.search.outline().corners, corner) < 0.3);
    }
  }
}

TEST_CASE("a plate with other than four corners is refused with how many it has and where") {
  const std::vector<Border> plates{regular(3, 250),
                                   regular(5, 220),
                                   regular(6, 220),
                                   regular(5, 60),
                                   regular(3, 80),
                                   {{0, 0}, {400, 0}, {400, 150}, {200, 150}, {200, 300}, {0, 300}},
                                   {{0, 0}, {400, 0}, {400, 200}, {250, 300}, {0, 300}},
                                   {{0, 0}, {300, 0}, {300, 240}, {240, 240}, {240, 300}, {0, 300}}};
  for (const Border& plate : plates) {
    for (int turn = 0; turn < 6; ++turn) {
      const Border border = turned(plate, 0.3 + 1.1 * turn);
      const Found found(border, static_cast<unsigned>(turn + 1));
      CAPTURE(plate.size());
      CAPTURE(turn);
      REQUIRE_FALSE(found.result.has_value());
      CHECK(found.result.error() == Error::not_four_sided);
      CHECK(found.search.corners().size() == plate.size());
      CHECK(found.search.share_along() > 0.97);
      for (const Vector2d& corner : border) CHECK(nearest(found.search.corners(), corner) < 3);
    }
  }
}

TEST_CASE("rounded corners bend no side and are named with their radius, or are too much to be trusted") {
  for (const double radius : {5.0, 10.0, 20.0, 40.0, 60.0}) {
    const std::vector<Vector2d> tracked{{3, 4}, {398, -2}, {402, 297}, {1, 303}};
    const Found found(rounded(radius), tracked);
    CAPTURE(radius);
    const auto named = found.search.deviations();
    REQUIRE(named.size() == 4);
    for (const OutlineDeviation& d : named) {
      CHECK(d.kind == Kind::corner_rounded);
      CHECK(std::abs(d.radius_mm - radius) < 1 + 0.05 * radius);
    }
    for (const Vector2d& corner : rectangle(400, 300))
      CHECK(nearest(found.search.outline().corners, corner) < 0.5);
    // The arc's middle lies 0.41 radii from where the sides meet: 17 mm with 40 mm.
    CHECK(found.result.has_value() == (radius < 35));
  }
}

TEST_CASE("a notch bends no side: what is deep is refused, what is not is named, both with place and size") {
  for (const double depth : {3.0, 10.0, 40.0}) {
    const Border border{{0, 0},     {400, 0},   {400, 100}, {400 - depth, 100}, {400 - depth, 180},
                        {400, 180}, {400, 300}, {0, 300}};
    const Found found(border);
    CAPTURE(depth);
    CHECK(found.result.has_value() == (depth < 15));
    REQUIRE(found.search.worst() != nullptr);
    const OutlineDeviation& worst = *found.search.worst();
    CHECK(worst.kind == Kind::step);
    CHECK(std::abs(worst.inwards_mm - depth) < 0.5);
    CHECK(std::abs(worst.length_mm - 80) < 6);
    CHECK(std::abs(worst.place.y() - 140) < 5);
    for (const Vector2d& corner : rectangle(400, 300))
      CHECK(nearest(found.search.outline().corners, corner) < 0.5);
  }
}

TEST_CASE("a rim that is torn all round is taken at the corners that the tracker saw, and named") {
  for (unsigned seed = 1; seed <= 8; ++seed) {
    CAPTURE(seed);
    // A panel broken out by hand: teeth of up to 9 mm on every side, and 19 mm out of a corner.
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> width(4, 40), depth(0, 12);
    Border border;
    const Border corners = rectangle(1400, 700);
    for (std::size_t i = 0; i < 4; ++i) {
      const Vector2d side = corners[(i + 1) % 4] - corners[i], way = side.normalized(),
                     inwards{-way.y(), way.x()};
      for (double from = i == 0 ? 19 : 9; from < side.norm() - (i == 3 ? 19 : 9);) {
        const double to = from + width(random), in = depth(random);
        border.insert(border.end(),
                      {corners[i] + way * from + inwards * in, corners[i] + way * to + inwards * in});
        from = to;
      }
    }
    const Found found(border, std::vector<Vector2d>{{12, 14}, {1394, 6}, {1393, 695}, {7, 692}});
    REQUIRE(found.result.has_value());
    double torn = 0;
    for (const OutlineDeviation& d : found.search.deviations())
      torn += d.kind == Kind::ragged || d.kind == Kind::apart ? d.length_mm : 0;
    CHECK(torn > 800);
    for (const Vector2d& corner : corners) CHECK(nearest(found.search.outline().corners, corner) < 20);
  }
}

TEST_CASE("a disc has no corners, whatever the tracker took for some") {
  const Border disc = regular(180, 200);
  const Found none(disc, {{200, 0}, {0, 200}, {-200, 0}, {0, -200}, {141, 141}});
  REQUIRE_FALSE(none.result.has_value());
  CHECK(none.result.error() == Error::not_four_sided);
  const Found untracked(disc, std::vector<Vector2d>{});
  REQUIRE_FALSE(untracked.result.has_value());
  CHECK(untracked.result.error() == Error::not_four_sided);
  CHECK(untracked.search.corners().empty());
}

TEST_CASE("searching an outline takes bounded steps and no heap, good plate or bad") {
  for (const Border& border : {rectangle(400, 300), rounded(20)}) {
    const std::vector<Vector2d> points = test::seen(border), tracked{{3, 4}, {398, -2}, {402, 297}, {1, 303}};
    OutlineSearch search(points.size(), {}, {}, {});
    const std::size_t before = test::allocations();
    search.begin(points, tracked);
    std::expected<bool, Error> done = false;
    int steps = 0;
    while (done && !*done && steps < 100'000) done = search.step(), ++steps;
    CHECK(test::allocations() == before);
    CHECK(done.value());
    CHECK(steps > 100);
  }
}
