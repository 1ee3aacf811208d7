#include "tasks/cell/shot_evidence.hpp"

#include "tasks/flat_world.hpp"

#include <doctest/doctest.h>

#include <algorithm>

using namespace moldloft;
using namespace moldloft::tasks;

namespace {

// What is kept of one shot over the middle of a plate that fills the field.
RunEvidence kept_of(std::uint32_t stripes, std::uint32_t points) {
  const FlatWorld world{.outline = {{-300, -300}, {300, -300}, {300, 300}, {-300, 300}}};
  const std::size_t all = std::size_t{stripes} * points;
  hal::Frame frame{static_cast<std::uint16_t>(stripes), static_cast<std::uint32_t>(all)};
  const ShotPlace place{.centre = {0, 0, 100}};
  const auto motion = geometry::turned_about_z(place.head_yaw, place.centre);
  world.expose(motion, frame, stripes, points);
  ShotView view{static_cast<std::uint16_t>(stripes), static_cast<std::uint32_t>(all), {}};
  view.begin(frame, {.hint = {0, 0, -94}, .reach_mm = 18});
  while (!view.step()) {
  }
  REQUIRE(view.found());
  EvidenceBook book{{.max_shots = 2}};
  book.begin();
  book.add({.number = 1, .place = place, .world_from_scanner = motion, .plate_found = true}, view);
  return book.evidence();
}

double farthest(const std::vector<double>& sorted) {
  double gap = 0;
  for (std::size_t i = 1; i < sorted.size(); ++i) gap = std::max(gap, sorted[i] - sorted[i - 1]);
  return gap;
}

}  // namespace

TEST_CASE("what is kept of a shot covers its whole field, however many stripes and points a frame has") {
  struct Make {
    std::uint32_t stripes, points;
  };
  for (const auto& [stripes, points] : {Make{12, 300}, {40, 1280}, {100, 500}, {200, 500}, {400, 2000}}) {
    CAPTURE(stripes);
    const RunEvidence kept = kept_of(stripes, points);
    REQUIRE(kept.shots.size() == 1);
    CHECK(kept.runs.size() <= 64);
    CHECK(kept.samples.size() <= 128);
    CHECK(kept.samples.size() > 30);

    std::vector<double> columns, samples;
    for (const SeenRun& run : kept.runs) columns.push_back(run.first.x());
    for (const Eigen::Vector3d& p : kept.samples) samples.push_back(p.x());
    std::ranges::sort(columns);
    std::ranges::sort(samples);
    const double stripe_apart = 102.0 / (stripes - 1);
    CHECK(columns.front() < -51 + 3 * stripe_apart + 3);
    CHECK(columns.back() > 51 - 3 * stripe_apart - 3);
    // 40 stripes over 102 mm lie 2.6 mm apart; the thinning is by whole stripes.
    CHECK(farthest(columns) < std::max(5.2, stripe_apart + 0.1));
    CHECK(samples.back() > 51 - 2 * farthest(samples) - 0.1);
    CHECK(samples.front() < -51 + 2 * farthest(samples) + 0.1);
    CHECK(farthest(samples) < std::max(12.0, 2 * stripe_apart + 0.1));
    for (const SeenRun& run : kept.runs) {
      CHECK(run.at_first == RunEdge::none);
      CHECK(run.last.y() - run.first.y() > 100);
    }
  }
}

TEST_CASE("a shot beyond those planned is not kept, and nothing is written where nothing may be") {
  const FlatWorld world{.outline = {{-300, -300}, {300, -300}, {300, 300}, {-300, 300}}};
  hal::Frame frame{100, 50000};
  const auto motion = geometry::turned_about_z(0, {0, 0, 100});
  world.expose(motion, frame);
  EvidenceBook book{{.max_shots = 2}};
  book.begin();
  for (std::uint32_t shot = 1; shot <= 5; ++shot) {
    ShotView view{100, 50000, {}};
    view.begin(frame, {.hint = {0, 0, -94}, .reach_mm = 18});
    while (!view.step()) {
    }
    book.add({.number = shot, .place = {}, .world_from_scanner = motion, .plate_found = true}, view);
  }
  CHECK(book.evidence().shots.size() == 2);
  CHECK(book.evidence().runs.size() <= 2 * 64);
}

TEST_CASE("what a shot saw at the border of its field is known to whoever asks near there") {
  const FlatWorld world{.outline = {{-300, -300}, {300, -300}, {300, 300}, {-300, 300}}};
  hal::Frame frame{100, 50000};
  const ShotPlace place{.centre = {40, -20, 100}, .head_yaw = 0.6};
  const auto motion = geometry::turned_about_z(place.head_yaw, place.centre);
  world.expose(motion, frame);
  ShotView view{100, 50000, {}};
  view.begin(frame, {.hint = {0, 0, -94}, .reach_mm = 18});
  while (!view.step()) {
  }
  EvidenceBook book{{.max_shots = 2}};
  book.begin();
  book.add({.number = 1, .place = place, .world_from_scanner = motion, .plate_found = true}, view);
  for (const double x : {-48.0, 0.0, 48.0}) {
    for (const double y : {-48.0, 0.0, 48.0}) {
      CAPTURE(x);
      CAPTURE(y);
      const Eigen::Vector3d asked = motion * Eigen::Vector3d{x, y, 0};
      const auto known = book.known_near({.centre = asked}, 8, 8);
      REQUIRE(known.has_value());
      CHECK((known->head<2>() - asked.head<2>()).norm() < 8);
      CHECK(known->z() == doctest::Approx(6));
    }
  }
  CHECK_FALSE(book.known_near({.centre = motion * Eigen::Vector3d{70, 0, 0}}, 8, 8).has_value());
}
