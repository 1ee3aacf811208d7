#include "geometry/inspection/foot_point.hpp"

#include "geometry/heap_watch.hpp"
#include "geometry/inspection/known_surfaces.hpp"

#include <doctest/doctest.h>

#include <limits>

using namespace moldloft::geometry;
using namespace moldloft::test;

namespace {

PreparedSurface prepared(const BSplineSurface& surface) { return PreparedSurface::from(surface).value(); }

FootPoint guessed_foot(const PreparedSurface& surface, const Vector3d& p) {
  const Parameters guess = surface.guess_of(p);
  return foot_near(surface, p, guess.u, guess.v);
}

// The least distance over a fine grid: no foot may be farther, and none is nearer by more than
// the grid misses.
double sampled_distance(const BSplineSurface& surface, const Vector3d& p, int steps) {
  double least = std::numeric_limits<double>::infinity();
  for (int i = 0; i <= steps; ++i) {
    for (int j = 0; j <= steps; ++j) {
      const double u = static_cast<double>(i) / steps, v = static_cast<double>(j) / steps;
      least = std::min(least, (surface.at(u, v).value - p).norm());
    }
  }
  return least;
}

}  // namespace

TEST_CASE("feet on a plane are projections, signed by the side to which r_u x r_v points") {
  const RigidMotion tilt = motion_about({10, 20, 30}, 25, {1, 2, 0.5}, {3, 1, 4});
  const PreparedSurface plane = prepared(moved(tilt, plate(4, 200, [](double, double) { return 0.0; })));
  const Vector3d up = tilt.linear().col(2);
  std::mt19937 random(3);
  std::uniform_real_distribution<double> inside(1, 199), height(-20, 20);
  for (int k = 0; k < 200; ++k) {
    const Vector3d flat = tilt * Vector3d(inside(random), inside(random), 0);
    const double d = height(random);
    const FootPoint foot = guessed_foot(plane, flat + d * up);
    CHECK(foot.converged);
    CHECK((foot.point - flat).norm() < 1e-12);
    CHECK(std::abs(foot.signed_mm - d) < 1e-12);
    CHECK(std::abs(foot.distance_mm - std::abs(d)) < 1e-12);
    CHECK((foot.normal - up).norm() < 1e-14);
    CHECK(foot.place == FootPlace::interior);
    CHECK(foot.overhang_mm == 0);
  }
}

TEST_CASE("feet of points up to 20 mm off a plate are orthogonal to 1e-12 mm") {
  const BSplineSurface surface = yard_plate();
  const PreparedSurface fast = prepared(surface);
  std::mt19937 random(4);
  std::uniform_real_distribution<double> inside(0.1, 0.9), side(-1, 1);
  for (const double off : {0.0, 1e-3, 5.0, 20.0}) {
    for (int k = 0; k < 60; ++k) {
      const double u = inside(random), v = inside(random);
      const SurfacePoint r = surface.at(u, v);
      const double d = side(random) > 0 ? off : -off;
      const Vector3d p = r.value + d * r.normal();
      const FootPoint foot = guessed_foot(fast, p);
      REQUIRE(foot.converged);
      CHECK(off_orthogonal(surface, p, foot.u, foot.v) < 1e-12);
      // 20 mm is well within the plate's radius of curvature (300 mm): the foot is where p came from.
      CHECK(std::abs(foot.u - u) * 305 < 1e-11);
      CHECK(std::abs(foot.v - v) * 305 < 1e-11);
      CHECK(std::abs(foot.signed_mm - d) < 1e-12);
      CHECK((foot.normal - r.normal()).norm() < 1e-12);
      CHECK(foot.steps <= 5);
    }
  }
}

TEST_CASE("feet are as orthogonal 10 m from the origin") {
  const BSplineSurface surface =
      moved(motion_about({0, 0, 0}, 3, {1, 1, 0}, {7000, -6000, 2000}), yard_plate());
  const PreparedSurface fast = prepared(surface);
  std::mt19937 random(5);
  std::uniform_real_distribution<double> inside(0.1, 0.9), off(-20, 20);
  for (int k = 0; k < 60; ++k) {
    const SurfacePoint r = surface.at(inside(random), inside(random));
    const Vector3d p = r.value + off(random) * r.normal();
    const FootPoint foot = guessed_foot(fast, p);
    CHECK(off_orthogonal(surface, p, foot.u, foot.v) < 1e-12);
  }
}

TEST_CASE("a foot by distance lies within 1e-6 mm of the true one, and its distance within 1e-11 mm") {
  const PreparedSurface fast = prepared(yard_plate());
  std::mt19937 random(6);
  std::uniform_real_distribution<double> inside(5, 300), height(-40, 40);
  for (int k = 0; k < 2000; ++k) {
    const Vector3d p(inside(random), inside(random), height(random));
    const Parameters guess = fast.guess_of(p);
    const FootPoint exact = foot_near(fast, p, guess.u, guess.v);
    const FootPoint quick = foot_near(fast, p, guess.u, guess.v, FootAccuracy::by_distance);
    CHECK((exact.point - quick.point).norm() < 1e-6);
    // The last step, 0.01 mm at the most, is expanded to second order: 14 / 80^3 / mm^2 * 0.01^3 / 6 is left.
    CHECK(std::abs(exact.signed_mm - quick.signed_mm) < 1e-11);
    CHECK(quick.steps <= exact.steps);
  }
}

TEST_CASE("the nearest foot beats every sample of a surface that folds over itself") {
  for (unsigned seed = 1; seed <= 6; ++seed) {
    const BSplineSurface surface = wild_surface(seed);
    const PreparedSurface fast = prepared(surface);
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> number(-60, 60);
    for (int k = 0; k < 12; ++k) {
      const Vector3d p(number(random), number(random), number(random));
      const NearestFoot nearest = nearest_foot(fast, p);
      CHECK(nearest.gap_mm <= 1.001e-6);
      CHECK(nearest.foot.distance_mm <= sampled_distance(surface, p, 150) + nearest.gap_mm + 1e-12);
      // ... and it is a place of the surface.
      const Vector3d there = surface.at(nearest.foot.u, nearest.foot.v).value;
      CHECK((there - nearest.foot.point).norm() < 1e-11);
      CHECK(std::abs((there - p).norm() - nearest.foot.distance_mm) < 1e-11);
    }
  }
}

TEST_CASE("a descent never ends farther away than it began, from any guess") {
  const BSplineSurface surface = wild_surface(7);
  const PreparedSurface fast = prepared(surface);
  std::mt19937 random(7);
  std::uniform_real_distribution<double> number(-60, 60), unit(0, 1);
  int settled = 0;
  for (int k = 0; k < 500; ++k) {
    const Vector3d p(number(random), number(random), number(random));
    const double u = unit(random), v = unit(random);
    const FootPoint foot = foot_near(fast, p, u, v);
    CHECK(foot.distance_mm <= (surface.at(u, v).value - p).norm() + 1e-12);
    settled += foot.converged;
    if (foot.converged && foot.place == FootPlace::interior)
      CHECK(off_orthogonal(surface, p, foot.u, foot.v) < 1e-9);  // folds have any curvature
  }
  CHECK(settled >= 495);
}

TEST_CASE("distances from a cylinder are those from its axis, within what the spline misses of the circle") {
  // Control points at R / cos-like radius; how far the spline is from the cylinder is measured
  // on 2000 samples.
  const double radius = 400;
  BSplineSurface surface = plate(12, 1, [](double, double) { return 0.0; });
  for (int i = 0; i < surface.control_u(); ++i) {
    for (int j = 0; j < surface.control_v(); ++j) {
      const double angle = 1.2 * (greville(surface.knots_u, i) - 0.5);
      surface.x(i, j) = radius * std::sin(angle), surface.z(i, j) = radius * std::cos(angle);
      surface.y(i, j) = 300 * greville(surface.knots_v, j);
    }
  }
  double least = radius, most = 0;
  for (double u = 0; u <= 1; u += 0.0005) {
    const Vector3d p = surface.at(u, 0.5).value;
    const double r = std::hypot(p.x(), p.z());
    least = std::min(least, r), most = std::max(most, r);
  }
  const double slack = 1e-7 * radius;  // between the samples
  const PreparedSurface fast = prepared(surface);
  std::mt19937 random(8);
  std::uniform_real_distribution<double> angle(-0.5, 0.5), along(10, 290), off(-30, 30);
  for (int k = 0; k < 300; ++k) {
    const double a = angle(random), r = radius + off(random);
    const Vector3d p(r * std::sin(a), along(random), r * std::cos(a));
    const double outside =
        nearest_foot(fast, p).foot.signed_mm;  // r_u x r_v: x cross y is up, away from the axis
    CHECK(outside >= r - most - slack);
    CHECK(outside <= r - least + slack);
  }
  // On the axis every place of a whole arc is about as near: the search must still end, and prove its answer.
  const NearestFoot middle = nearest_foot(fast, {0, 150, 0});
  CHECK(middle.gap_mm <= 1.001e-6);
  CHECK(middle.foot.distance_mm <= least + slack);
  CHECK(middle.foot.distance_mm >= least - slack);
}

TEST_CASE("a search that runs out of pieces says how much nearer another place might be") {
  // Near the centre of curvature of a bowl nothing can be left alone.
  const PreparedSurface bowl = prepared(plate(4, 200, [](double x, double y) {
    return 100 - std::sqrt(100.0 * 100 * 4 - (x - 100) * (x - 100) - (y - 100) * (y - 100));
  }));
  const NearestFoot few = nearest_foot(bowl, {100, 100, 100}, 30);
  const NearestFoot many = nearest_foot(bowl, {100, 100, 100}, 200'000);
  CHECK(few.pieces < 200);
  CHECK(few.gap_mm > 1e-3);
  CHECK(many.gap_mm < few.gap_mm);
  CHECK(few.foot.distance_mm - few.gap_mm <= many.foot.distance_mm);
}

TEST_CASE(
    "beyond the border the foot is on the nearest side or corner and says how far the point stands out") {
  const PreparedSurface flat = prepared(plate(5, 100, [](double, double) { return 0.0; }));
  const FootPoint side = guessed_foot(flat, {104, 30, 3});
  CHECK(side.place == FootPlace::side);
  CHECK(side.u == 1);
  CHECK((side.point - Vector3d(100, 30, 0)).norm() < 1e-13);
  CHECK(std::abs(side.overhang_mm - 4) < 1e-13);
  CHECK(std::abs(side.signed_mm - 3) < 1e-13);
  CHECK(std::abs(side.distance_mm - 5) < 1e-13);
  const FootPoint corner = guessed_foot(flat, {-3, 104, -12});
  CHECK(corner.place == FootPlace::corner);
  CHECK(corner.u == 0);
  CHECK(corner.v == 1);
  CHECK(std::abs(corner.overhang_mm - 5) < 1e-13);
  CHECK(std::abs(corner.distance_mm - 13) < 1e-13);
  CHECK(std::abs(corner.signed_mm + 12) < 1e-13);
  CHECK(guessed_foot(flat, {50, 50, 9}).place == FootPlace::interior);
  const FootPoint edge = guessed_foot(flat, {100, 60, 2});
  CHECK(edge.place == FootPlace::side);
  CHECK(edge.overhang_mm < 1e-13);
  // From a guess on the wrong side the descent leaves the border again.
  const FootPoint wrong = foot_near(flat, {20, 30, 1}, 1, 1);
  CHECK(wrong.place == FootPlace::interior);
  CHECK(std::abs(wrong.u - 0.2) < 1e-14);
}

TEST_CASE("beyond the border of a curved plate no sample of the border is nearer") {
  const BSplineSurface surface = yard_plate();
  const PreparedSurface fast = prepared(surface);
  std::mt19937 random(9);
  std::uniform_real_distribution<double> along(-20, 325), out(0, 30), height(-20, 20);
  for (int k = 0; k < 100; ++k) {
    Vector3d p(along(random), along(random), height(random));
    p[k % 2] = k % 4 < 2 ? -out(random) : 305 + out(random);
    const FootPoint foot = guessed_foot(fast, p);
    CHECK(foot.converged);
    double least = std::numeric_limits<double>::infinity();
    for (double t = 0; t <= 1; t += 1.0 / 2048) {
      for (const auto& [u, v] : {std::pair{t, 0.0}, {t, 1.0}, {0.0, t}, {1.0, t}})
        least = std::min(least, (surface.at(u, v).value - p).norm());
    }
    if (foot.place != FootPlace::interior) {
      CHECK(foot.distance_mm <= least + 1e-12);
      CHECK(foot.distance_mm >= least - 305.0 / 2048);
    } else {
      CHECK(foot.distance_mm <= least);
    }
  }
}

TEST_CASE("a foot moves with its surface") {
  const RigidMotion motion = motion_about({100, 50, -3}, 77, {0.2, -1, 0.4}, {-20, 33, 8});
  const PreparedSurface here = prepared(yard_plate()), there = prepared(moved(motion, yard_plate()));
  std::mt19937 random(10);
  std::uniform_real_distribution<double> inside(-10, 315), height(-40, 40);
  for (int k = 0; k < 100; ++k) {
    const Vector3d p(inside(random), inside(random), height(random));
    const FootPoint a = nearest_foot(here, p).foot, b = nearest_foot(there, motion * p).foot;
    CHECK(std::abs(a.u - b.u) < 1e-13);
    CHECK(std::abs(a.v - b.v) < 1e-13);
    CHECK(std::abs(a.signed_mm - b.signed_mm) < 1e-12);
    CHECK(a.place == b.place);
  }
}

TEST_CASE("the nearest place of a roof is found on its ridge, where no tangent plane is") {
  // A knot of multiplicity 3 at u = 1/2: two planes that meet at a right angle above x = 0.
  BSplineSurface roof{{0, 0, 0, 0, 0.5, 0.5, 0.5, 1, 1, 1, 1}, uniform_clamped_knots(1), {}, {}, {}};
  roof.x.resize(7, 4), roof.y.resize(7, 4), roof.z.resize(7, 4);
  for (int i = 0; i < 7; ++i) {
    for (int j = 0; j < 4; ++j)
      roof.x(i, j) = 10 * (i - 3), roof.y(i, j) = 20 * j, roof.z(i, j) = -10 * std::abs(i - 3);
  }
  const NearestFoot ridge = nearest_foot(prepared(roof), {1, 31, 8});
  CHECK(std::abs(ridge.foot.u - 0.5) < 1e-9);
  CHECK(std::abs(ridge.foot.distance_mm - std::sqrt(65.0)) < 1e-9);
  CHECK(ridge.gap_mm <= 1.001e-6);
}

TEST_CASE("what is not a number has no foot") {
  const PreparedSurface fast = prepared(yard_plate());
  CHECK(!foot_near(fast, {std::nan(""), 1, 2}, 0.5, 0.5).converged);
  CHECK(!foot_near(fast, {std::numeric_limits<double>::infinity(), 1, 2}, 0.5, 0.5).converged);
  CHECK(foot_near(fast, {30, 40, 2}, std::nan(""), 5).converged);  // a guess may be anything
}

TEST_CASE("finding feet takes no memory") {
  const PreparedSurface fast = prepared(yard_plate());
  const PreparedSurface wild = prepared(wild_surface(2));
  const std::size_t before = allocations();
  const FootPoint near = guessed_foot(fast, {100, 120, 9});
  const NearestFoot nearest = nearest_foot(wild, {10, -7, 9});
  CHECK(allocations() == before);
  CHECK((near.converged && nearest.pieces > 0));
}

TEST_CASE("a point that is no place has no foot, and every answer about it says so without a NaN") {
  const double nan = std::nan(""), infinite = std::numeric_limits<double>::infinity();
  for (const BSplineSurface& surface :
       {yard_plate(), moved(motion_about({0, 0, 0}, 90, {1, 0, 0}, {0, 0, 0}), yard_plate())}) {
    const auto prepared = PreparedSurface::from(surface);
    for (const Vector3d& p : {Vector3d(nan, 0, 0), Vector3d(0, nan, 0), Vector3d(0, 0, nan),
                              Vector3d(infinite, 0, 0), Vector3d(0, -infinite, 0), Vector3d(0, 0, infinite),
                              Vector3d(1e300, 0, 0), Vector3d(0, -1e200, 5)}) {
      const FootPoint near = foot_near(*prepared, p, 0.5, 0.5);
      const NearestFoot all = nearest_foot(*prepared, p);
      for (const FootPoint& foot : {near, all.foot}) {
        CHECK(!foot.converged);
        CHECK(foot.distance_mm == infinite);
        CHECK(foot.point.allFinite());
        CHECK(foot.normal.allFinite());
        CHECK((foot.point - surface.at(foot.u, foot.v).value).norm() < 1e-9);
      }
      CHECK(all.gap_mm == infinite);
      const Parameters guess = prepared->guess_of(p);
      CHECK((guess.u >= 0 && guess.u <= 1 && guess.v >= 0 && guess.v <= 1));
    }
    CHECK(prepared->at(nan, nan).value.allFinite());
    CHECK(foot_near(*prepared, {1, 2, 3}, nan, nan).converged);
    // Far off is far off, and no more.
    const NearestFoot far = nearest_foot(*prepared, {1e30, 0, 0});
    CHECK(std::abs(far.foot.distance_mm / 1e30 - 1) < 1e-12);
  }
}
