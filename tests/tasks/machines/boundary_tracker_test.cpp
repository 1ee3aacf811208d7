#include "tasks/machines/boundary_tracker.hpp"

#include "tasks/flat_world.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <string>

using namespace moldloft;
using namespace moldloft::tasks;
using Eigen::Vector2d;

namespace {

std::vector<Vector2d> placed(std::vector<Vector2d> corners, double turn) {
  Vector2d middle = Vector2d::Zero();
  for (const auto& c : corners) middle += c / static_cast<double>(corners.size());
  for (auto& c : corners) c = Eigen::Rotation2Dd(turn) * (c - middle) + Vector2d{500, 20};
  return corners;
}

const std::vector<Vector2d> square{{0, 0}, {305, 0}, {305, 305}, {0, 305}};
const std::vector<Vector2d> rectangle{{0, 0}, {600, 0}, {600, 150}, {0, 150}};
const std::vector<Vector2d> trapezoid{{0, 0}, {305, 0}, {245, 254}, {60, 254}};
const std::vector<Vector2d> sheared{
    {0, 0}, {260, 0}, {390, 225}, {130, 225}};  // corners of 60 and 120 degrees

double distance_to_outline(const Vector2d& p, const std::vector<Vector2d>& outline) {
  double least = 1e9;
  for (std::size_t i = 0; i < outline.size(); ++i) {
    const Vector2d a = outline[i], d = outline[(i + 1) % outline.size()] - a;
    const double t = std::clamp((p - a).dot(d) / d.squaredNorm(), 0.0, 1.0);
    least = std::min(least, (p - a - t * d).norm());
  }
  return least;
}

const ShotPlace start{.centre = {500, 20, 5}, .head_yaw = 0};

}  // namespace

TEST_CASE("the loop closes on every four-sided plate, however it is turned, and sees all four corners") {
  BoundaryTracker tracker{TrackerSettings{.overlap_mm = 45}};
  for (const auto& shape : {square, rectangle, trapezoid, sheared}) {
    for (double turn = 0; turn < 6.28; turn += 0.21) {
      const FlatWorld world{.outline = placed(shape, turn)};
      const Walk walk = walk_round(tracker, world, start);
      INFO("turned by ", turn);
      REQUIRE(walk.last.to == TrackState::closed);
      for (const auto& corner : world.outline) {
        double nearest = 1e9;
        for (const auto& seen : tracker.corners()) nearest = std::min(nearest, (seen - corner).norm());
        CHECK(nearest < 3);
      }
    }
  }
}

TEST_CASE(
    "every edge point that is remembered lies on the outline, and the outline has no stretch without one") {
  BoundaryTracker tracker{TrackerSettings{.overlap_mm = 45}};
  const FlatWorld world{.outline = placed(trapezoid, 0.7)};
  REQUIRE(walk_round(tracker, world, start).last.to == TrackState::closed);
  for (const auto& p : tracker.edge_points()) CHECK(distance_to_outline(p, world.outline) < 0.3);
  for (std::size_t i = 0; i < 4; ++i) {
    const Vector2d a = world.outline[i], b = world.outline[(i + 1) % 4];
    for (double t = 0.02; t < 1; t += 0.02) {
      const Vector2d p = a + t * (b - a);
      const bool seen = std::any_of(tracker.edge_points().begin(), tracker.edge_points().end(),
                                    [&](const Vector2d& e) { return (e - p).norm() < 6; });
      CHECK(seen);
    }
  }
}

TEST_CASE("a boundary parallel to the stripes is found by turning the head") {
  BoundaryTracker tracker{TrackerSettings{}};
  const FlatWorld world{.outline = placed(square, 0)};  // stripes along y, the first edge met along x too
  const Walk walk = walk_round(tracker, world, start);
  CHECK(walk.last.to == TrackState::closed);
  CHECK(walk.turns == 1);  // the first turn crosses both the boundary and where the stripes were
}

TEST_CASE(
    "where the boundary hides, the head turns so that stripes cross both what was seen and what hides") {
  BoundaryTracker tracker{TrackerSettings{}};
  tracker.begin(start);
  // A straight piece along world +x through the field's middle, made by hand: scanner at yaw 0, stripes along y.
  std::vector<geometry::EdgePoint> points;
  for (int i = 0; i < 20; ++i)
    points.push_back({.position = {2.0 * i - 20, 0, 0}, .stripe = static_cast<std::uint16_t>(i)});
  geometry::BoundaryPiece piece;
  piece.count = 20;
  piece.tangent_first = piece.tangent_last = {1, 0};
  const auto show = [&] {
    geometry::BoundaryViewer::View view;
    view.points = points;
    view.pieces = {&piece, 1};
    return tracker.take({.world_from_scanner = geometry::turned_about_z(0, start.centre),
                         .plate_found = true,
                         .plate_z_mm = 6,
                         .view = view});
  };
  REQUIRE(show().to == TrackState::first_side);
  REQUIRE(show().to == TrackState::track);
  piece.hidden_last = true;
  const auto step = show();
  REQUIRE(step.action == TrackAction::turn);
  const double stripe = step.next->head_yaw + 1.5707963;
  CHECK(std::abs(std::sin(stripe)) > 0.7);  // across the seen side, which runs along x
  CHECK(std::abs(std::cos(stripe)) > 0.7);  // across the old stripes, along which the rest hides
}

TEST_CASE("a start off the plate is said so when every height has been looked at") {
  BoundaryTracker tracker{TrackerSettings{}};
  const FlatWorld world{.outline = placed(square, 0)};
  const Walk walk = walk_round(tracker, world, {.centre = {900, 20, 5}, .head_yaw = 0});
  CHECK(walk.last.to == TrackState::failed);
  CHECK(walk.shots == 6);
  CHECK(std::string{walk.last.text.view()} ==
        "no plate under the scanner at x 900 y 20 mm, looked for at 6 heights: move [start] onto the plate");
}

TEST_CASE("a plate is sought above and below the start, as far as the arm goes") {
  BoundaryTracker tracker{TrackerSettings{.lowest_z_mm = -100, .highest_z_mm = 220, .storey_mm = 96}};
  tracker.begin({.centre = {500, 0, 15}, .head_yaw = 0});
  std::vector<double> heights;
  BoundaryTracker::Step step;
  for (int i = 0; i < 9 && step.to != TrackState::failed; ++i) {
    step = tracker.take({.world_from_scanner = geometry::turned_about_z(0, {500, 0, 15}),
                         .plate_found = false,
                         .plate_z_mm = 0,
                         .view = {}});
    if (!step.next) continue;
    heights.push_back(step.next->centre.z());
    CHECK(tracker.plate_hint().z() == heights.back());
  }
  CHECK(heights == std::vector<double>{111, -81, 207});
  CHECK(step.to == TrackState::failed);
  CHECK(step.text.view().find("looked for at 4 heights") != std::string_view::npos);
}

TEST_CASE("a plate without an end within the seek limit is said so") {
  BoundaryTracker tracker{TrackerSettings{.max_seek_steps = 5}};
  const FlatWorld world{.outline = {{-5000, -5000}, {5000, -5000}, {5000, 5000}, {-5000, 5000}}};
  const Walk walk = walk_round(tracker, world, start);
  CHECK(walk.last.to == TrackState::failed);
  CHECK(walk.last.action == TrackAction::report_no_edge);
  CHECK(walk.shots == 6);
}

TEST_CASE("a plan that is one shot or one edge point too small is said so, one that just holds is enough") {
  const FlatWorld world{.outline = placed(rectangle, 0.3)};
  BoundaryTracker roomy{TrackerSettings{}};
  const int shots = walk_round(roomy, world, start).shots;
  const std::size_t edges = roomy.edge_points().size();
  REQUIRE(roomy.state() == TrackState::closed);
  REQUIRE(shots > 10);
  REQUIRE(edges > 1000);

  BoundaryTracker exact{TrackerSettings{.max_shots = shots, .max_edge_points = edges}};
  CHECK(walk_round(exact, world, start).last.to == TrackState::closed);
  CHECK(std::ranges::equal(exact.edge_points(), roomy.edge_points()));

  BoundaryTracker few_shots{TrackerSettings{.max_shots = shots - 1}};
  const Walk stopped = walk_round(few_shots, world, start);
  CHECK(stopped.last.action == TrackAction::report_too_large);
  CHECK(stopped.shots == shots - 1);
  CHECK(stopped.last.text.view().starts_with("outline not closed after " + std::to_string(shots - 1) +
                                             " shots,"));

  BoundaryTracker few_edges{TrackerSettings{.max_edge_points = edges - 1}};
  const Walk full = walk_round(few_edges, world, start);
  CHECK(full.last.to == TrackState::failed);
  CHECK(full.last.action == TrackAction::report_too_large);
  CHECK(full.last.text.view().ends_with("raise [plate] largest_mm"));
  // Those before are all there, those of the last shot have not been begun with.
  const std::size_t kept = few_edges.edge_points().size();
  CHECK(kept < edges);
  CHECK(std::ranges::equal(few_edges.edge_points(), roomy.edge_points().first(kept)));
}

TEST_CASE("heads that turn at every place do not outrun the plan's shots") {
  // A boundary that hides, then shows, for ever: the table alone would go on as long as it is told so.
  BoundaryTracker tracker{TrackerSettings{.max_shots = 12}};
  const FlatWorld world{.outline = placed(rectangle, 0.3)};
  hal::Frame frame{100, 50000};
  ShotView view{100, 50000, {}};
  tracker.begin(start);
  ShotPlace place = start;
  int shots = 0;
  for (; shots < 100; ++shots) {
    const auto motion = geometry::turned_about_z(place.head_yaw, place.centre);
    world.expose(motion, frame);
    view.begin(frame, {.hint = motion.inverse() * tracker.plate_hint(), .reach_mm = 60});
    while (!view.step()) {
    }
    std::vector<geometry::BoundaryPiece> pieces(view.boundary().pieces.begin(), view.boundary().pieces.end());
    auto seen = view.boundary();
    for (auto& piece : pieces) piece.hidden_last = tracker.state() == TrackState::track;
    seen.pieces = pieces;
    const auto step = tracker.take(
        {.world_from_scanner = motion, .plate_found = true, .plate_z_mm = world.plate_z, .view = seen});
    if (!step.next) break;
    place = *step.next;
  }
  CHECK(tracker.state() == TrackState::failed);
  CHECK(shots + 1 == 12);
}

namespace {

// 300 x 300 mm about (500, 20), all corners arcs; turned so that no side runs along the stripes.
bool in_rounded_square(const Vector2d& p, double radius, double turn = 0.3) {
  const Vector2d d = (Eigen::Rotation2Dd(-turn) * (p - Vector2d(500, 20))).cwiseAbs();
  const Vector2d beyond = (d - Vector2d::Constant(150 - radius)).cwiseMax(0);
  return d.maxCoeff() < 150 && beyond.norm() < radius;
}

}  // namespace

TEST_CASE("a rounded corner costs a shot or two, not fifty") {
  BoundaryTracker tracker{TrackerSettings{}};
  const Walk sharp = walk_round(
      tracker, {.outline = {}, .shape = [](const Vector2d& p) { return in_rounded_square(p, 0.01); }}, start);
  REQUIRE(sharp.last.to == TrackState::closed);
  for (const double radius : {3.0, 5.0, 10.0, 20.0, 40.0, 70.0}) {
    CAPTURE(radius);
    const FlatWorld world{.outline = {},
                          .shape = [&](const Vector2d& p) { return in_rounded_square(p, radius); }};
    const Walk walk = walk_round(tracker, world, start);
    CHECK(walk.last.to == TrackState::closed);
    CHECK(walk.shots <= sharp.shots + 4 * 2);
  }
}

TEST_CASE("a rim of teeth or scallops is gone round once, however its edge turns") {
  BoundaryTracker tracker{TrackerSettings{}};
  for (const double depth : {3.0, 6.0, 12.0}) {
    for (const double pitch : {20.0, 33.0, 60.0}) {
      CAPTURE(depth);
      CAPTURE(pitch);
      const FlatWorld world{.outline = {}, .shape = [&](const Vector2d& p) {
                              const Vector2d d = Eigen::Rotation2Dd(-0.3) * (p - Vector2d(500, 20));
                              const double along = std::abs(d.x()) > std::abs(d.y()) ? d.y() : d.x();
                              const double in = depth * std::abs(std::sin(3.14159 * along / pitch));
                              return d.cwiseAbs().maxCoeff() < 150 - in;
                            }};
      const Walk walk = walk_round(tracker, world, start);
      CHECK(walk.last.to == TrackState::closed);
      CHECK(walk.shots < 60);
    }
  }
}

TEST_CASE(
    "a plate that was moved on the way round is told by how far from its beginning the edge comes round") {
  for (const double push : {-30.0, -11.0, 11.0}) {
    CAPTURE(push);
    BoundaryTracker tracker{TrackerSettings{}};
    int shots = 0;
    hal::Frame frame{100, 50000};
    ShotView view{100, 50000, {}};
    ShotPlace place = start;
    tracker.begin(start);
    BoundaryTracker::Step last;
    for (; shots < 100; ++shots) {
      const auto motion = geometry::turned_about_z(place.head_yaw, place.centre);
      const double moved = shots < 8 ? 0 : push;
      const FlatWorld world{.outline = {}, .shape = [&](const Vector2d& p) {
                              return in_rounded_square(p - Vector2d(moved, 0), 0.01);
                            }};
      world.expose(motion, frame);
      const bool seeking = tracker.state() == TrackState::seek_edge;
      view.begin(frame, {.hint = motion.inverse() * tracker.plate_hint(), .reach_mm = seeking ? 60.0 : 18.0});
      while (!view.step()) {
      }
      last = tracker.take({.world_from_scanner = motion,
                           .plate_found = view.found(),
                           .plate_z_mm = world.plate_z,
                           .view = view.boundary()});
      if (!last.next) break;
      place = *last.next;
    }
    CHECK(shots < 30);
    CHECK(last.event == TrackEvent::passes_beside);
    CHECK(last.text.view().find("the edge comes round") == 0);
    CHECK(last.text.view().find("largest_mm") == std::string_view::npos);
  }
}

TEST_CASE(
    "a hole on the way to the edge is left behind, small or large, and the plate's own boundary found") {
  BoundaryTracker tracker{TrackerSettings{}};
  for (const double radius : {8.0, 20.0, 35.0, 48.0}) {
    for (const double x : {540.0, 570.0, 590.0}) {
      CAPTURE(radius);
      CAPTURE(x);
      const FlatWorld world{.outline = {}, .shape = [&](const Vector2d& p) {
                              return in_rounded_square(p, 0.01) && (p - Vector2d(x, 30)).norm() > radius;
                            }};
      const Walk walk = walk_round(tracker, world, {.centre = {460, 20, 5}, .head_yaw = 0});
      INFO(walk.last.text.view());
      INFO(walk.shots);
      CHECK(walk.last.to == TrackState::closed);
      double widest = 0;
      for (const auto& p : tracker.edge_points()) widest = std::max(widest, (p - Vector2d(500, 20)).norm());
      CHECK(widest > 200);
    }
  }
}
