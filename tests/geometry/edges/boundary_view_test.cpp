#include "geometry/edges/boundary_view.hpp"

#include "geometry/edges/stripe_scene.hpp"
#include "geometry/heap_watch.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <numbers>
#include <random>

using namespace moldloft;
using geometry::BoundaryPiece, geometry::BoundaryViewer, geometry::PlateRunFinder;
using test::rectangle, test::StripeScene;
using Kind = BoundaryPiece::Kind;

namespace {

constexpr double degree = std::numbers::pi / 180;

struct Seen {
  test::Frame frame;
  PlateRunFinder finder{100, 50'000};
  BoundaryViewer viewer{4000};
  std::span<const geometry::PlateRun> runs;
  BoundaryViewer::View view;
};

void look(Seen& seen, const StripeScene& scene, Eigen::Vector3d hint = {0, 0, 0}) {
  seen.frame = sample(scene);
  const auto runs = seen.finder.find(seen.frame.views, hint, {});
  REQUIRE(runs.has_value());
  seen.runs = *runs;
  seen.view = seen.viewer.look(*runs, seen.frame.views.size(), {});
}

double angle_of(const Eigen::Vector2d& d) { return std::atan2(d.y(), d.x()); }

double angle_between(double a, double b) { return std::abs(std::remainder(a - b, 2 * std::numbers::pi)); }

// A plate of 300 mm whose corner 0 lies at `corner` and whose side 0 leaves it at `angle`.
StripeScene corner_at(Eigen::Vector2d corner, double angle, unsigned seed = 1) {
  StripeScene scene;
  scene.outline = rectangle(corner, angle, 300, 300);
  scene.seed = seed;
  return scene;
}

}  // namespace

TEST_CASE("a side is travelled with the plate on the left, its tangent true to a quarter of a degree") {
  for (double angle = -170; angle < 190; angle += 20) {
    if (std::abs(std::cos(angle * degree)) < 0.2) continue;  // nearly along the stripes: another test
    StripeScene scene;
    const double a = angle * degree;
    const Eigen::Vector2d along(std::cos(a), std::sin(a)), inward(-along.y(), along.x());
    scene.outline = rectangle(-150 * along - 10 * inward, a, 300, 300);
    scene.wall_points = 2;
    Seen seen;
    look(seen, scene, {10 * inward.x(), 10 * inward.y(), 0});
    REQUIRE(seen.view.pieces.size() == 1);
    const BoundaryPiece& side = seen.view.pieces[0];
    CAPTURE(angle);
    CHECK(side.kind == Kind::side);
    CHECK(angle_between(angle_of(side.tangent_first), a) < 0.25 * degree);
    CHECK(angle_between(angle_of(side.tangent_last), a) < 0.25 * degree);
    CHECK(std::abs(side.turn) < 0.3 * degree);
    CHECK_FALSE(side.hidden_first);
    CHECK_FALSE(side.hidden_last);
    CHECK_FALSE(seen.view.plate_fills_field);
    CHECK(side.count > 30);
    CHECK(side.rms_mm < 0.1);
  }
}

TEST_CASE("a right corner anywhere in the field is found where the outline has it, or said to hide") {
  double worst = 0, worst_turn = 0;
  int corners = 0;
  for (double angle = 0; angle < 360; angle += 15) {
    for (unsigned seed = 1; seed <= 3; ++seed) {
      std::mt19937 random(seed);
      std::uniform_real_distribution<double> within(-25, 25);
      const Eigen::Vector2d corner(within(random), within(random));
      const double a = (angle + 7) * degree;
      const StripeScene scene = corner_at(corner, a, seed);
      const Eigen::Vector2d inside =
          corner + 20 * Eigen::Vector2d(std::cos(a + 45 * degree), std::sin(a + 45 * degree));
      Seen seen;
      look(seen, scene, {inside.x(), inside.y(), 0});
      CAPTURE(angle);
      CAPTURE(seed);
      REQUIRE(seen.view.pieces.size() >= 1);
      const BoundaryPiece& piece = seen.view.pieces[0];
      if (piece.kind == Kind::side) {
        // Only where a side leans by less than 9 degrees from the stripes and shows fewer than four points.
        CHECK(std::min(std::abs(std::sin(a)), std::abs(std::cos(a))) < 0.15);
        CHECK((piece.hidden_first || piece.hidden_last));
        continue;
      }
      ++corners;
      worst = std::max(worst, (piece.corner - corner).norm());
      worst_turn = std::max(worst_turn, std::abs(piece.turn - 90 * degree));
      CHECK(angle_between(angle_of(piece.tangent_last), a) < 1 * degree);
      CHECK(angle_between(angle_of(piece.tangent_first), a - 90 * degree) < 1 * degree);
    }
  }
  MESSAGE(corners << " corners, worst position " << worst << " mm, worst turn " << worst_turn / degree
                  << " degrees");
  CHECK(corners >= 60);
  CHECK(worst < 0.3);
}

TEST_CASE("corners of 60 and 120 degrees turn by their true angle") {
  for (const double inner : {60.0, 120.0}) {
    StripeScene scene;
    const double a = 20 * degree, b = a + inner * degree;
    scene.outline = {{0, 0},
                     {300 * std::cos(a), 300 * std::sin(a)},
                     {300 * (std::cos(a) + std::cos(b)), 300 * (std::sin(a) + std::sin(b))},
                     {300 * std::cos(b), 300 * std::sin(b)}};
    Seen seen;
    look(seen, scene, {15 * std::cos((a + b) / 2), 15 * std::sin((a + b) / 2), 0});
    REQUIRE(seen.view.pieces.size() == 1);
    CHECK(seen.view.pieces[0].kind == Kind::corner);
    CHECK(seen.view.pieces[0].turn == doctest::Approx((180 - inner) * degree).epsilon(0.01));
    CHECK(seen.view.pieces[0].corner.norm() < 0.3);
  }
}

TEST_CASE("a corner near the field's limit is found from few points on one side") {
  // Side 0 runs along +x at y = 0 and ends at x = 44: about seven stripes show the side that comes back
  // at 45 degrees.
  StripeScene scene;
  scene.outline = {{-300, 0}, {44, 0}, {144, 100}, {-300, 100}};
  Seen seen;
  look(seen, scene, {0, 20, 0});
  REQUIRE(seen.view.pieces.size() == 1);
  const BoundaryPiece& piece = seen.view.pieces[0];
  CHECK(piece.kind == Kind::corner);
  CHECK(piece.count - piece.points_before < 9);
  CHECK((piece.corner - Eigen::Vector2d(44, 0)).norm() < 0.4);
}

TEST_CASE("a boundary parallel to the stripes is reported as hidden") {
  SUBCASE("no edge point at all: the region ends with a stripe that crosses the whole field") {
    StripeScene scene;
    scene.outline = rectangle({-200, -200}, 0, 217.3, 400);  // the plate's right side at x = 17.3
    Seen seen;
    look(seen, scene);
    CHECK(seen.view.pieces.empty());
    CHECK_FALSE(seen.view.plate_fills_field);
    CHECK_FALSE(seen.view.hidden_low_x_mm.has_value());
    REQUIRE(seen.view.hidden_high_x_mm.has_value());
    CHECK(*seen.view.hidden_high_x_mm == doctest::Approx(17.3).epsilon(0.04));
  }
  SUBCASE("a corner of which only one side shows") {
    StripeScene scene;
    scene.outline = rectangle({-200, -10}, 0, 217.3, 400);
    Seen seen;
    look(seen, scene, {0, 10, 0});
    REQUIRE(seen.view.pieces.size() == 1);
    CHECK(seen.view.pieces[0].kind == Kind::side);
    CHECK_FALSE(seen.view.pieces[0].hidden_first);
    CHECK(seen.view.pieces[0].hidden_last);
  }
  SUBCASE("the same on the other side") {
    StripeScene scene;
    scene.outline = rectangle({-17.3, -10}, 0, 300, 400);
    Seen seen;
    look(seen, scene, {0, 10, 0});
    REQUIRE(seen.view.pieces.size() == 1);
    CHECK(seen.view.pieces[0].kind == Kind::side);
    CHECK(seen.view.pieces[0].hidden_first);
    CHECK_FALSE(seen.view.pieces[0].hidden_last);
  }
  SUBCASE("a side within a degree of the stripes, two points of it seen") {
    StripeScene scene;
    scene.outline = rectangle({-200, -10}, 0, 217.3, 400);
    scene.outline[2].x() += 1.5 * 4;  // leans by 0.86 degrees
    Seen seen;
    look(seen, scene, {0, 10, 0});
    REQUIRE(seen.view.pieces.size() >= 1);
    CHECK(seen.view.pieces[0].kind == Kind::side);
    CHECK(seen.view.pieces[0].hidden_last);
    CHECK(std::abs(angle_of(seen.view.pieces[0].tangent_last)) < 0.5 * degree);
  }
}

TEST_CASE("a plate that fills the field shows no piece") {
  StripeScene scene;
  scene.outline = rectangle({-200, -200}, 0.3, 600, 600);
  scene.outline = {{-200, -200}, {200, -200}, {200, 200}, {-200, 200}};
  Seen seen;
  look(seen, scene);
  CHECK(seen.view.plate_fills_field);
  CHECK(seen.view.pieces.empty());
}

TEST_CASE("two corners in one field are two pieces") {
  StripeScene scene;
  scene.outline = rectangle({-25, -20}, 10 * degree, 55, 200);
  Seen seen;
  look(seen, scene, {0, 10, 0});
  REQUIRE(seen.view.pieces.size() == 2);
  int found = 0;
  for (const BoundaryPiece& piece : seen.view.pieces) {
    CHECK(piece.kind == Kind::corner);
    for (int c : {0, 1}) found += (piece.corner - scene.outline[c]).norm() < 0.3;
  }
  CHECK(found == 2);
}

TEST_CASE("a few false edge points neither bend a side nor make a corner") {
  StripeScene scene;
  scene.outline = rectangle({-150, -10}, 0.2, 400, 300);
  Seen seen;
  look(seen, scene, {0, 20, 0});
  std::vector<geometry::PlateRun> runs(seen.runs.begin(), seen.runs.end());
  for (const std::size_t k : {20, 21, 55, 80}) runs[k].edge_first.y() += 4.5;
  runs[33].edge_first.y() -= 3;
  const auto view = seen.viewer.look(runs, 100, {});
  REQUIRE(view.pieces.size() == 1);
  CHECK(view.pieces[0].kind == Kind::side);
  CHECK(angle_between(angle_of(view.pieces[0].tangent_first), 0.2) < 0.4 * degree);
  CHECK(view.points.size() == runs.size() - 5);
}

TEST_CASE("a side that bends gently stays a side") {
  // An edge on a circle of 400 mm: 1.6 mm of sagitta over the field.
  StripeScene scene;
  for (int i = 0; i < 360; ++i) {
    scene.outline.push_back({400 * std::cos(i * degree), 390 + 400 * std::sin(i * degree)});
  }
  Seen seen;
  look(seen, scene, {0, 20, 0});
  REQUIRE(seen.view.pieces.size() == 1);
  CHECK(seen.view.pieces[0].kind == Kind::side);
  CHECK(seen.view.pieces[0].turn == doctest::Approx(0.18).epsilon(0.2));
}

TEST_CASE("looking takes no memory") {
  Seen seen;
  look(seen, corner_at({3, 4}, 0.4), {8, 14, 0});
  const std::size_t before = test::allocations();
  (void)seen.viewer.look(seen.runs, 100, {});
  CHECK(test::allocations() == before);
}
