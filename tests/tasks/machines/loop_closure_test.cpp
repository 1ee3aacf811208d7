#include "tasks/machines/loop_closure.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <numbers>

using namespace moldloft::tasks;
using Eigen::Vector2d;
using Verdict = LoopClosure::Verdict;

namespace {

constexpr double pi = std::numbers::pi;

Vector2d on_circle(const Vector2d& middle, double radius, double angle) {
  return middle + radius * Vector2d{std::cos(angle), std::sin(angle)};
}

// Along a circle from angle 0; the first verdict that is not `open`, and where it fell.
struct Told {
  Verdict verdict = Verdict::open;
  double angle = 0;
};
Told walk_circle(LoopClosure loop, const Vector2d& middle, double radius, double turns, double grows = 0) {
  const double step = 1.4 / radius * (turns > 0 ? 1 : -1);
  for (double angle = 0; std::abs(angle) < std::abs(turns) * 2 * pi; angle += step) {
    const Verdict verdict = loop.go_on_to(on_circle(middle, radius + grows * angle / (2 * pi), angle));
    if (verdict != Verdict::open) return {verdict, angle};
  }
  return {};
}

}  // namespace

TEST_CASE("a walk once round closes where it began, not before, wherever the point on the plate lies") {
  const Vector2d middle{500, 20};
  for (const double radius : {30.0, 150.0, 2000.0}) {
    const Vector2d anchor = on_circle(middle, radius, 0);
    for (const double inside : {0.0, 0.5, 0.8}) {
      CAPTURE(radius);
      CAPTURE(inside);
      const Told told =
          walk_circle({anchor, middle + inside * radius * Vector2d{0.6, 0.8}, 8}, middle, radius, 1.5);
      CHECK(told.verdict == Verdict::closed);
      CHECK(std::abs(told.angle - 2 * pi) * radius < 8.1);
    }
  }
}

TEST_CASE("a walk that comes round beside its beginning is told with how far beside") {
  for (const double grows : {-40.0, -12.0, 12.0, 40.0}) {
    CAPTURE(grows);
    LoopClosure loop{{650, 20}, {500, 20}, 8};
    const Told told = walk_circle(loop, {500, 20}, 150, 1.5, grows);
    CHECK(told.verdict == Verdict::beside);
    for (double angle = 0; angle < told.angle + 0.01; angle += 0.01)
      loop.go_on_to(on_circle({500, 20}, 150 + grows * angle / (2 * pi), angle));
    CHECK(loop.beside_mm() == doctest::Approx(std::abs(grows)).epsilon(0.1));
  }
}

TEST_CASE(
    "a walk round a hole is told from one round the plate, whether the point lies outside or in the hole") {
  for (const double radius : {13.0, 25.0, 60.0}) {
    for (const Vector2d& on_plate : {Vector2d{420, 20}, Vector2d{502, 24}}) {
      CAPTURE(radius);
      const Vector2d middle{500, 20}, anchor = on_circle(middle, radius, 0);
      CHECK(walk_circle({anchor, on_plate, 8}, middle, radius, -1.5).verdict == Verdict::hole);
    }
  }
}

TEST_CASE("a walk that steps back over its beginning has gone round nothing") {
  LoopClosure loop{{650, 20}, {500, 20}, 8};
  for (const double end : {0.3, 0.1, 0.6, -0.1, 0.9}) {
    for (double k = 0; k <= 1; k += 0.01)
      CHECK(loop.go_on_to(on_circle({500, 20}, 150 + std::sin(40 * k), k * end)) == Verdict::open);
  }
}
