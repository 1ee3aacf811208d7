// The stated bounds of PlanMap::invert on outlines that are skewed and bent at random, and of PlanMap::check
// on those that are no map.
#include "geometry/fit/plan_map.hpp"
#include "geometry/outline_shapes.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <limits>
#include <random>

using namespace moldloft;
using Eigen::Vector2d;
using geometry::Error, geometry::Outline, geometry::PlanMap;
using test::bent_outline, test::straight_outline;

namespace {

// Corners moved by up to a quarter of the side, sides bent by up to a tenth of it, somewhere within 20 m.
Outline random_outline(std::mt19937& random, int spans) {
  std::uniform_real_distribution<double> unit(-1, 1);
  const Vector2d at(10'000 * unit(random), 10'000 * unit(random));
  const double size = 300 * std::exp(1.5 * unit(random)), turn = 3 * unit(random);
  std::array<Vector2d, 4> corners;
  const Vector2d square[4] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
  for (int i = 0; i < 4; ++i) {
    const Vector2d c = square[i] + 0.25 * Vector2d(unit(random), unit(random));
    corners[i] = at + size * Vector2d(std::cos(turn) * c.x() - std::sin(turn) * c.y(),
                                      std::sin(turn) * c.x() + std::cos(turn) * c.y());
  }
  Outline outline = straight_outline(corners, spans);
  for (auto& side : outline.sides) {
    const Vector2d d = side.control.back() - side.control.front();
    const double bow = 0.1 * unit(random), wave = 0.02 * unit(random);
    for (std::size_t i = 1; i + 1 < side.control.size(); ++i) {
      const double t = static_cast<double>(i) / static_cast<double>(side.control.size() - 1);
      side.control[i] += (4 * bow * t * (1 - t) + wave * std::sin(9 * t)) * Vector2d(d.y(), -d.x());
    }
  }
  return outline;
}

}  // namespace

TEST_CASE(
    "a plan position is inverted to 1e-10 mm on skewed and bent outlines, from any guess, to its own "
    "parameters") {
  std::mt19937 random(12);
  std::uniform_real_distribution<double> unit(0, 1);
  int maps = 0;
  for (int trial = 0; trial < 400; ++trial) {
    const PlanMap map(random_outline(random, 1 + trial % 8));
    if (!map.check()) continue;
    ++maps;
    for (int i = 0; i < 50; ++i) {
      const Vector2d uv(unit(random), unit(random));
      const Vector2d xy = map.at(uv.x(), uv.y()).value;
      const Vector2d near = uv + 0.01 * Vector2d(unit(random) - 0.5, unit(random) - 0.5);
      for (const Vector2d& guess :
           {near, Vector2d(unit(random), unit(random)), Vector2d(0, 0), Vector2d(1, 0)}) {
        const auto back = map.invert(xy, guess);
        CAPTURE(trial);
        CAPTURE(uv);
        CAPTURE(guess);
        REQUIRE(back.has_value());
        CHECK((map.at(back->x(), back->y()).value - xy).norm() <= 1e-10);
        // 1e-10 mm over the map's least stretch there, with a tenth for its bend on so short a way.
        const double least = map.at(uv.x(), uv.y()).jacobian.jacobiSvd().singularValues()[1];
        CHECK((*back - uv).norm() <= 1.1 * 2e-10 / least);
      }
    }
  }
  CHECK(maps > 200);
}

TEST_CASE("positions far off, and guesses that are no numbers or far off, are answered") {
  const PlanMap map(bent_outline());
  const Vector2d uv(0.3, 0.6), xy = map.at(0.3, 0.6).value;
  for (const Vector2d& guess :
       {Vector2d(NAN, 0.5), Vector2d(INFINITY, 0), Vector2d(1e300, -1e300), Vector2d(-50, 3)}) {
    const auto back = map.invert(xy, guess);
    REQUIRE(back.has_value());
    CHECK((*back - uv).norm() < 1e-11);
  }
  for (const Vector2d& far :
       {Vector2d(1e5, 0), Vector2d(-1e9, 1e9), Vector2d(1e300, 0), Vector2d(160, -2000)})
    CHECK(map.invert(far, {0.5, 0.5}, 0.05).error() == Error::outside_domain);
  CHECK(map.invert({INFINITY, 0}, {0.5, 0.5}).error() == Error::not_finite);
}

TEST_CASE("maps that fold, have no corner or no number are refused by name") {
  const auto error = [](const Outline& outline) { return PlanMap(outline).check().error(); };
  CHECK(PlanMap(bent_outline()).check().has_value());
  // Clockwise; crossed; one corner pulled inside (a Coons patch of straight sides folds there).
  CHECK(error(straight_outline({Vector2d(0, 0), {0, 100}, {100, 100}, {100, 0}})) == Error::folded_map);
  CHECK(error(straight_outline({Vector2d(0, 0), {100, 0}, {0, 100}, {100, 100}})) == Error::folded_map);
  CHECK(error(straight_outline({Vector2d(0, 0), {100, 0}, {30, 30}, {0, 100}})) == Error::folded_map);
  // A side that bends right across the plate.
  Outline deep = straight_outline({Vector2d(0, 0), {100, 0}, {100, 100}, {0, 100}});
  for (std::size_t i = 1; i + 1 < deep.sides[0].control.size(); ++i) deep.sides[0].control[i].y() += 150;
  CHECK(error(deep) == Error::folded_map);
  // Corners on one line; a corner of 180 degrees, where rounding decides the sign of the Jacobian;
  // sides without length.
  CHECK(error(straight_outline({Vector2d(0, 0), {100, 0}, {200, 0}, {300, 0}})) == Error::collinear);
  for (double turn = 0; turn < 6; turn += 0.37) {
    std::array<Vector2d, 4> triangle{Vector2d(0, 0), {100, 0}, {200, 0}, {80, 150}};
    for (Vector2d& c : triangle)
      c = {std::cos(turn) * c.x() - std::sin(turn) * c.y(), std::sin(turn) * c.x() + std::cos(turn) * c.y()};
    CHECK(error(straight_outline(triangle)) == Error::collinear);
  }
  CHECK(error(straight_outline({Vector2d(5, 5), {5, 5}, {5, 5}, {5, 5}})) == Error::collinear);
  Outline hole = bent_outline();
  hole.sides[2].control[3].x() = NAN;
  CHECK(error(hole) == Error::not_finite);
}
