#include "tasks/planning/scan_plan.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>

using namespace moldloft;
using namespace moldloft::tasks;
using Eigen::Vector2d;

namespace {

geometry::Outline straight(const std::array<Vector2d, 4>& corners) {
  geometry::Outline outline;
  outline.corners = corners;
  for (std::size_t i = 0; i < 4; ++i) {
    auto& side = outline.sides[i];
    side.knots = geometry::uniform_clamped_knots(1);
    for (int k = 0; k < 4; ++k)
      side.control.push_back(corners[i] + (corners[(i + 1) % 4] - corners[i]) * k / 3.0);
  }
  return outline;
}

std::array<Vector2d, 4> turned(std::array<Vector2d, 4> corners, double angle) {
  for (auto& c : corners) c = Eigen::Rotation2Dd(angle) * c;
  return corners;
}

bool covered(const Vector2d& p, std::span<const ShotPlace> places, const ScanPlanSettings& s) {
  for (const auto& place : places) {
    const Vector2d q = Eigen::Rotation2Dd(-place.head_yaw) * (p - place.centre.head<2>());
    if (std::abs(q.x()) <= s.field_x_mm / 2 + 1e-9 && std::abs(q.y()) <= s.field_y_mm / 2 + 1e-9) return true;
  }
  return false;
}

bool covers_all(const geometry::Outline& outline, std::span<const ShotPlace> places,
                const ScanPlanSettings& s) {
  const auto& c = outline.corners;
  for (double u = 0; u <= 1.0001; u += 0.02) {
    for (double v = 0; v <= 1.0001; v += 0.02) {
      const Vector2d p = (1 - u) * (1 - v) * c[0] + u * (1 - v) * c[1] + u * v * c[2] + (1 - u) * v * c[3];
      if (!covered(p, places, s)) return false;
    }
  }
  return true;
}

std::expected<std::size_t, geometry::Error> plan_zigzag(const geometry::Outline& outline,
                                                        const ScanPlanSettings& settings,
                                                        const Vector2d& from, double head_yaw_now,
                                                        std::span<ShotPlace> places) {
  ZigzagPlan plan;
  const HeightModel flat;
  plan.begin(outline, flat, settings, from, head_yaw_now, places);
  while (!plan.step()) {
  }
  return plan.result();
}

const std::array<Vector2d, 4> square{Vector2d{0, 0}, {305, 0}, {305, 305}, {0, 305}};
const std::array<Vector2d, 4> sheared{Vector2d{0, 0}, {300, 0}, {390, 280}, {90, 280}};

}  // namespace

TEST_CASE("the thesis's plate without overlap takes its nine shots") {
  std::array<ShotPlace, 64> places;
  const ScanPlanSettings s{.overlap_mm = 0, .margin_mm = 0};
  const auto outline = straight(std::array<Vector2d, 4>{Vector2d{0, 0}, {305, 0}, {305, 305}, {0, 305}});
  CHECK(plan_zigzag(outline, s, {0, 0}, 0, places).value() == 9);
}

TEST_CASE("the fields cover the plate wherever it lies, however it is turned and sheared") {
  const ScanPlanSettings s;
  for (const auto& shape : {square, sheared}) {
    for (double angle = -3; angle < 3; angle += 0.37) {
      std::array<ShotPlace, 64> places;
      const auto outline = straight(turned(shape, angle));
      const auto count = plan_zigzag(outline, s, outline.corners[2], 0.1, places);
      REQUIRE(count.has_value());
      CHECK(covers_all(outline, std::span{places}.first(*count), s));
      CHECK(*count <= 20);
      CHECK(std::abs(places[0].head_yaw - 0.1) <= 1.5708);  // of the two yaws that look the same, the nearer
    }
  }
}

TEST_CASE("without any overlap to spare the rows still reach as far as a sheared plate does") {
  const ScanPlanSettings s{.overlap_mm = 0, .margin_mm = 0};
  std::array<ShotPlace, 64> places;
  const auto outline = straight({Vector2d{0, 0}, {180, 0}, {480, 300}, {300, 300}});
  const std::size_t count = plan_zigzag(outline, s, {0, 0}, 0, places).value();
  CHECK(covers_all(outline, std::span{places}.first(count), s));
}

TEST_CASE("the zig-zag begins near the arm and never jumps over a row") {
  const ScanPlanSettings s;
  std::array<ShotPlace, 64> places;
  const auto outline = straight(square);
  const std::size_t count = plan_zigzag(outline, s, {305, 305}, 0, places).value();
  CHECK((places[0].centre.head<2>() - Vector2d{305, 305}).norm() < 80);
  for (std::size_t i = 1; i < count; ++i) {
    CHECK((places[i].centre - places[i - 1].centre).norm() < 102);
  }
}

TEST_CASE("more shots than the plan holds is a typed error") {
  std::array<ShotPlace, 8> places;
  CHECK(plan_zigzag(straight(square), {}, {0, 0}, 0, places).error() == geometry::Error::capacity);
}

TEST_CASE("a step of the plan is never more than a row") {
  std::array<ShotPlace, 64> places;
  places.fill({.head_yaw = NAN});
  const auto outline = straight(square);
  const HeightModel flat;
  ZigzagPlan plan;
  plan.begin(outline, flat, {}, {0, 0}, 0, places);
  const auto filled = [&] {
    return std::count_if(places.begin(), places.end(),
                         [](const ShotPlace& p) { return !std::isnan(p.head_yaw); });
  };
  int steps = 1;
  std::ptrdiff_t before = 0;
  for (; !plan.step(); ++steps) {
    CHECK(filled() - before <= 4);
    before = filled();
  }
  CHECK(filled() == 16);
  CHECK(steps == 4 + 1 + 4);  // the outline's sides, the turn to the plate, four rows of four
}

TEST_CASE("a plan begun anew owes nothing to the one before") {
  std::array<ShotPlace, 64> places, again;
  const auto outline = straight(square), other = straight(sheared);
  const HeightModel flat;
  ZigzagPlan plan;
  plan.begin(other, flat, {}, {390, 280}, 1, again);
  for (int i = 0; i < 7; ++i) plan.step();
  plan.begin(outline, flat, {}, {0, 0}, 0, again);
  while (!plan.step()) {
  }
  const std::size_t count = plan_zigzag(outline, {}, {0, 0}, 0, places).value();
  REQUIRE(plan.result().value() == count);
  for (std::size_t i = 0; i < count; ++i) CHECK(again[i].centre == places[i].centre);
}
