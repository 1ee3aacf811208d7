// Everything in edges/ that takes data from outside, given data that make no sense: each is refused by its
// own name, or left out where one bad number among thousands good ones is what a scanner gives. Nothing
// crashes and nothing invents a plate.
#include "geometry/edges/boundary_view.hpp"
#include "geometry/edges/corner_choice.hpp"
#include "geometry/edges/edge_lines.hpp"
#include "geometry/edges/outline.hpp"
#include "geometry/edges/plate_runs.hpp"
#include "geometry/edges/stripe_scene.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <limits>
#include <random>

using namespace moldloft;
using namespace moldloft::geometry;
using Eigen::Vector2d, Eigen::Vector3d;

namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

test::StripeScene half_plate() {
  test::StripeScene scene;
  scene.outline = test::rectangle({-200, -200}, 0, 400, 210);
  return scene;
}

std::expected<bool, Error> finished(CornerChoice& choice) {
  for (int i = 0; i < 200; ++i) {
    const auto done = choice.step();
    if (!done || *done) return done;
  }
  return false;
}

std::expected<bool, Error> finished(OutlineBuilder& builder) {
  for (int i = 0; i < 2000; ++i) {
    const auto done = builder.step();
    if (!done || *done) return done;
  }
  return false;
}

// Points every 2 mm along a closed polygon.
std::vector<Vector2d> along(std::span<const Vector2d> corners) {
  std::vector<Vector2d> points;
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const Vector2d a = corners[i], d = corners[(i + 1) % corners.size()] - a;
    for (double s = 1; s < d.norm(); s += 2) points.push_back(a + s * d.normalized());
  }
  return points;
}

const std::array<Vector2d, 4> square{Vector2d(0, 0), {300, 0}, {300, 300}, {0, 300}};

}  // namespace

TEST_CASE("runs: a frame of nothing, of NaN, or with a hint that is no number is refused by name") {
  test::Frame frame = sample(half_plate());
  PlateRunFinder finder(100, 50'000);
  CHECK(finder.find({}, {0, 0, 0}, {}).error() == Error::not_on_plate);
  for (const Vector3d& hint : {Vector3d(NAN, 0, 0), Vector3d(0, infinity, 0), Vector3d(0, 0, NAN)})
    CHECK(finder.find(frame.views, hint, {}).error() == Error::not_finite);
  const std::vector<StripeView> empty(100);
  CHECK(finder.find(empty, {0, 0, 0}, {}).error() == Error::not_on_plate);
  for (const float nothing :
       {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity()}) {
    for (auto& column : frame.z) std::ranges::fill(column, nothing);
    CHECK(finder.find(frame.views, {0, 0, 0}, {}).error() == Error::not_on_plate);
  }
}

TEST_CASE("runs: stripes that do not go along y, or jump about, are survived") {
  test::Frame frame = sample(half_plate());
  PlateRunFinder finder(100, 50'000);
  const auto all_good = [&] {
    const auto runs = finder.find(frame.views, {0, 0, 0}, {});
    if (!runs) return true;
    for (const PlateRun& run : *runs) {
      if (!run.edge_first.allFinite() || !run.edge_last.allFinite() || run.first > run.last) return false;
    }
    return true;
  };
  for (auto& column : frame.y) std::ranges::reverse(column);
  CHECK(all_good());
  for (auto& column : frame.y) std::ranges::fill(column, 1.0F);
  CHECK(all_good());
  std::mt19937 random(2);
  std::uniform_real_distribution<float> anything(-50, 50);
  for (auto& column : frame.y) {
    for (float& y : column) y = anything(random);
  }
  CHECK(all_good());
}

TEST_CASE("boundary: no runs show nothing, and runs whose edges are no numbers are left out") {
  BoundaryViewer viewer(4000);
  CHECK(viewer.look({}, 100, {}).pieces.empty());
  CHECK_FALSE(viewer.look({}, 0, {}).plate_fills_field);

  const test::Frame frame = sample(half_plate());
  PlateRunFinder finder(100, 50'000);
  const auto found = finder.find(frame.views, {0, 0, 0}, {});
  REQUIRE(found.has_value());
  std::vector<PlateRun> runs(found->begin(), found->end());
  for (std::size_t k = 10; k < runs.size(); k += 20) runs[k].edge_last.y() = NAN;
  const auto view = viewer.look(runs, 100, {});
  REQUIRE(view.pieces.size() == 1);
  CHECK(view.points.size() == 95);
  for (const EdgePoint& point : view.points) CHECK(point.position.allFinite());
  CHECK(std::abs(view.pieces[0].tangent_first.x()) == doctest::Approx(1).epsilon(1e-3));
}

TEST_CASE("lines: too few points split nowhere, and lines that are no numbers meet nowhere") {
  const std::vector<EdgePoint> none, one(1), three(3);
  for (const auto& points : {none, one, three}) {
    CHECK(best_split(points, 2) == 0);
    CHECK(split_at_farthest(points, 30, 2) == 0);
    CHECK(first_stretch(points, 30, 4).size() == points.size());
    CHECK(last_stretch(points, 30, 4).size() == points.size());
  }
  EdgeLine a, b;
  b.direction = {0, 1};
  CHECK(meeting_point(a, b).has_value());
  CHECK_FALSE(meeting_point(a, a).has_value());
  b.direction.x() = NAN;
  CHECK_FALSE(meeting_point(a, b).has_value());
  b.direction = {0, 1}, b.centre.y() = infinity;
  CHECK_FALSE(meeting_point(a, b).has_value());
  // Points that all coincide have a line, with some direction and no residual.
  const std::vector<EdgePoint> same(8, {{3, 4, 5}, 0});
  const EdgeLine line = fit_edge_line(same);
  CHECK(line.direction.norm() == doctest::Approx(1));
  CHECK(line.rms_mm < 1e-9);
}

TEST_CASE("corners: candidates or edge points that are no numbers, or none, are refused by name") {
  const auto edges = along(square);
  CornerChoice choice{{}};
  const auto error = [&](std::span<const Vector2d> e, std::span<const Vector2d> c) {
    choice.begin(e, c);
    return finished(choice).error();
  };
  auto candidates = std::vector<Vector2d>(square.begin(), square.end());
  choice.begin(edges, candidates);
  CHECK(finished(choice).value());
  CHECK(error({}, candidates) == Error::too_few_points);
  CHECK(error(edges, {}) == Error::too_few_points);
  candidates[2].y() = NAN;
  CHECK(error(edges, candidates) == Error::not_finite);
  candidates[2].y() = infinity;
  CHECK(error(edges, candidates) == Error::not_finite);
  auto holes = edges;
  holes[17].x() = NAN;
  CHECK(error(holes, square) == Error::not_finite);
  // All points on one line: no corner anywhere.
  std::vector<Vector2d> line;
  for (int i = 0; i < 400; ++i) line.emplace_back(2.0 * i, 0);
  const std::vector<Vector2d> on_line{{100, 0}, {300, 0}, {500, 0}, {700, 0}};
  CHECK(error(line, on_line) == Error::not_four_sided);
}

TEST_CASE("outline: points that are no numbers, coincide or lie on one line are refused by name") {
  OutlineBuilder builder(2000, {});
  const auto points = along(square);
  CHECK(builder.begin({}, square).error() == Error::too_few_points);
  CHECK(builder.begin(points, {}).error() == Error::not_four_sided);
  for (const double bad : {std::numeric_limits<double>::quiet_NaN(), infinity}) {
    auto holes = points;
    holes[77].y() = bad;
    CHECK(builder.begin(holes, square).error() == Error::not_finite);
  }
  const std::array<Vector2d, 4> clockwise{square[0], square[3], square[2], square[1]};
  CHECK(builder.begin(points, clockwise).error() == Error::collinear);
  const std::array<Vector2d, 4> twice{square[0], square[0], square[2], square[3]};
  CHECK(builder.begin(points, twice).error() == Error::collinear);

  const std::vector<Vector2d> same(100, Vector2d(150, 0));
  REQUIRE(builder.begin(same, square).has_value());
  CHECK(finished(builder).error() == Error::too_few_points);  // three sides without any
  std::vector<Vector2d> line;
  for (int i = 0; i < 400; ++i) line.emplace_back(0.7 * i, 0.7 * i);
  REQUIRE(builder.begin(line, square).has_value());
  CHECK(finished(builder).error() == Error::too_few_points);
  // Each side seen in one place only: it has no direction, so the sides that come out are the chords of the
  // hints or the builder says why not.
  std::vector<Vector2d> four;
  for (int side = 0; side < 4; ++side) {
    for (int i = 0; i < 20; ++i) four.push_back(0.5 * (square[side] + square[(side + 1) % 4]));
  }
  REQUIRE(builder.begin(four, square).has_value());
  if (finished(builder).has_value()) {
    for (int i = 0; i < 4; ++i) CHECK((builder.outline().corners[i] - square[i]).norm() < 1e-6);
  }
}

TEST_CASE("outline: hints in a cross are no outline") {
  OutlineBuilder builder(2000, {});
  const std::array<Vector2d, 4> crossed{square[0], square[1], square[3], square[2]};
  CHECK(builder.begin(along(square), crossed).error() ==
        Error::collinear);  // its two halves span no area together
}
