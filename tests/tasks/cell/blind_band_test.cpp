#include "tasks/cell/blind_band.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <random>

using namespace moldloft;
using namespace moldloft::tasks;

namespace {

constexpr double field_mm = 102;

// Runs along y of a scanner that sees y from `low` to `high` of a plate whose edge is a line in the world.
struct Line {
  Eigen::Vector2d at, inwards;
};
void add_shot(RunEvidence& evidence, const ShotPlace& place, double low, double high,
              std::optional<Line> edge = {}) {
  static std::mt19937 random{3};
  std::normal_distribution<double> noise{0, 0.1};
  const auto motion = geometry::turned_about_z(place.head_yaw, place.centre);
  for (double x = -48; x <= 48; x += 3) {
    double from = low, to = high;
    for (double y = low; edge && y <= high; y += 0.05) {
      const Eigen::Vector2d p = (motion * Eigen::Vector3d{x, y, 0}).head<2>();
      if ((p - edge->at).dot(edge->inwards) < 0) from = y + 0.05;
    }
    if (from >= to - 3) continue;
    evidence.runs.push_back({.first = motion * Eigen::Vector3d{x, from + noise(random), 0},
                             .last = motion * Eigen::Vector3d{x, to + noise(random), 0}});
  }
  evidence.shots.push_back({.number = static_cast<std::uint32_t>(evidence.shots.size() + 1),
                            .place = place,
                            .world_from_scanner = motion,
                            .plate_found = true,
                            .runs_end = static_cast<std::uint32_t>(evidence.runs.size())});
}

}  // namespace

TEST_CASE("a scanner that is dark on one side is told with the share and the shot from which on") {
  for (const double y : {-40.0, -10.0, 0.0, 25.0}) {
    for (const bool low : {true, false}) {
      CAPTURE(y);
      CAPTURE(low);
      RunEvidence evidence;
      for (int i = 0; i < 12; ++i) {
        const ShotPlace place{.centre = {500 + 70.0 * (i % 4), 40.0 * (i / 4), 0}, .head_yaw = 0.3 * (i % 3)};
        const bool is_dark = i >= 5;
        add_shot(evidence, place, is_dark && low ? y : -51, is_dark && !low ? y : 51);
      }
      const auto band = blind_band(evidence, field_mm);
      REQUIRE(band.has_value());
      CHECK(band->shot == 5);
      CHECK(band->is_low == low);
      CHECK(band->y_mm == doctest::Approx(y).epsilon(0.02).scale(1));
      CHECK(band->share(field_mm) == doctest::Approx((low ? y + 51 : 51 - y) / 102).epsilon(0.02));
    }
  }
}

TEST_CASE("a plate's edge along which the scanner goes is no blind band") {
  RunEvidence evidence;
  for (int i = 0; i < 20; ++i)
    add_shot(evidence, {.centre = {500 + 70.0 * i, 0, 0}}, -51, 51, Line{{500, 0}, {0, 1}});
  CHECK_FALSE(blind_band(evidence, field_mm).has_value());
  // Nor the whole way round, at whatever angle the edge is crossed.
  RunEvidence round;
  for (int i = 0; i < 24; ++i) {
    const double angle = 0.26 * i;
    const Eigen::Vector2d at{150 * std::cos(angle), 150 * std::sin(angle)};
    add_shot(round, {.centre = {at.x(), at.y(), 0}, .head_yaw = 0.785 * (i / 6)}, -51, 51,
             Line{at, -at.normalized()});
  }
  CHECK_FALSE(blind_band(round, field_mm).has_value());
}

TEST_CASE("two shots are too few to call a scanner blind, and none is no defect") {
  RunEvidence evidence;
  CHECK_FALSE(blind_band(evidence, field_mm).has_value());
  for (int i = 0; i < 2; ++i) add_shot(evidence, {.centre = {500, 70.0 * i, 0}}, -10, 51);
  CHECK_FALSE(blind_band(evidence, field_mm).has_value());
  add_shot(evidence, {.centre = {500, 140, 0}}, -10, 51);
  CHECK(blind_band(evidence, field_mm).has_value());
}
