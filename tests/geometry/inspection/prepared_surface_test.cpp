#include "geometry/inspection/prepared_surface.hpp"

#include "geometry/heap_watch.hpp"
#include "geometry/inspection/known_surfaces.hpp"

#include <doctest/doctest.h>

#include <limits>

using namespace moldloft::geometry;
using namespace moldloft::test;

namespace {
constexpr double eps = std::numeric_limits<double>::epsilon();
}

TEST_CASE("a prepared surface has the values and derivatives of the surface it came from") {
  for (const BSplineSurface& surface : {wild_surface(1), wild_surface(2), yard_plate()}) {
    const auto prepared = PreparedSurface::from(surface);
    REQUIRE(prepared);
    const double size = std::max(
        {surface.x.cwiseAbs().maxCoeff(), surface.y.cwiseAbs().maxCoeff(), surface.z.cwiseAbs().maxCoeff()});
    double shortest = 1;
    for (int i = 0; i < prepared->along_u().count(); ++i)
      shortest = std::min(shortest, prepared->along_u().end_of(i) - prepared->along_u().begin_of(i));
    for (double u = 0; u <= 1; u += 0.0173) {
      for (double v = 0; v <= 1; v += 0.0191) {
        const SurfacePoint a = prepared->at(u, v), b = surface.at(u, v);
        CHECK((a.value - b.value).cwiseAbs().maxCoeff() <= 32 * eps * size);
        const double first = 64 * eps * size / shortest, second = first / shortest;
        CHECK((a.du - b.du).cwiseAbs().maxCoeff() <= first);
        CHECK((a.dv - b.dv).cwiseAbs().maxCoeff() <= first);
        CHECK((a.duu - b.duu).cwiseAbs().maxCoeff() <= second);
        CHECK((a.duv - b.duv).cwiseAbs().maxCoeff() <= second);
        CHECK((a.dvv - b.dvv).cwiseAbs().maxCoeff() <= second);
      }
    }
  }
}

TEST_CASE("parameters outside the domain are those of its border") {
  const auto prepared = PreparedSurface::from(yard_plate());
  CHECK(prepared->at(-1, 0.3).value == prepared->at(0, 0.3).value);
  CHECK(prepared->at(0.2, 7).value == prepared->at(0.2, 1).value);
}

TEST_CASE("boxes contain their spans, and boxes above contain those below") {
  const BSplineSurface surface = wild_surface(3);
  const auto prepared = PreparedSurface::from(surface);
  const KnotCells &in_u = prepared->along_u(), &in_v = prepared->along_v();
  for (double u = 0; u <= 1; u += 0.01) {
    for (double v = 0; v <= 1; v += 0.01) {
      const Vector3d p = surface.at(u, v).value;
      int i = in_u.locate(u), j = in_v.locate(v);
      for (int level = 0; level < prepared->levels(); ++level, i /= 2, j /= 2)
        CHECK(prepared->box(level, i, j).squared_distance(p) == 0);
    }
  }
  CHECK(prepared->boxes_u(prepared->levels() - 1) * prepared->boxes_v(prepared->levels() - 1) == 1);
}

TEST_CASE("bounds of a span hold at every place of it") {
  const auto prepared = PreparedSurface::from(wild_surface(4));
  const KnotCells &in_u = prepared->along_u(), &in_v = prepared->along_v();
  const double rounding = 1 + 1e-12;
  for (double u = 0; u <= 1; u += 0.013) {
    for (double v = 0; v <= 1; v += 0.013) {
      const SurfacePoint p = prepared->at(u, v);
      const SpanBounds& b = prepared->bounds(in_u.locate(u), in_v.locate(v));
      CHECK(p.du.squaredNorm() * rounding >= b.least_du2);
      CHECK(p.dv.squaredNorm() * rounding >= b.least_dv2);
      CHECK(std::abs(p.du.dot(p.dv)) <= b.most_du_dv * rounding);
      CHECK(p.duu.norm() <= b.most_duu * rounding);
      CHECK(p.duv.norm() <= b.most_duv * rounding);
      CHECK(p.dvv.norm() <= b.most_dvv * rounding);
    }
  }
}

TEST_CASE("where x and y are linear the plan view's guess is exact") {
  const auto prepared = PreparedSurface::from(yard_plate());
  REQUIRE(prepared->is_explicit());
  for (double u = 0; u <= 1; u += 0.031) {
    for (double v = 0; v <= 1; v += 0.037) {
      const Parameters guess = prepared->guess_of({305 * u, 305 * v, 100});
      CHECK(std::abs(guess.u - u) < 1e-13);
      CHECK(std::abs(guess.v - v) < 1e-13);
    }
  }
  CHECK(prepared->guess_of({-50, 400, 0}).u == 0);
  CHECK(prepared->guess_of({-50, 400, 0}).v == 1);
}

TEST_CASE("where the plan view is bent the guess is off by the second order of a table cell") {
  // x = 300 u + 20 u v, y = 300 v: of the inverse u = x / (300 + y / 15) only u_yy and u_xy are not zero, and
  // what is interpolated bilinearly errs by h^2 / 8 u_yy at the most.
  BSplineSurface surface = plate(10, 300, [](double x, double y) { return 0.01 * x + 0.02 * y; });
  for (int i = 0; i < surface.control_u(); ++i) {
    for (int j = 0; j < surface.control_v(); ++j)
      surface.x(i, j) += 20 * greville(surface.knots_u, i) * greville(surface.knots_v, j);
  }
  const auto prepared = PreparedSurface::from(surface);
  REQUIRE(prepared->is_explicit());
  const double h = 300.0 / 20, u_yy = 2 * 320 / (15.0 * 15.0) / std::pow(300, 3);
  for (double u = 0.06; u < 0.9; u += 0.031) {
    for (double v = 0; v <= 1; v += 0.037) {
      const Parameters guess = prepared->guess_of({300 * u + 20 * u * v, 300 * v, 0});
      CHECK(std::abs(guess.u - u) < h * h / 8 * u_yy + 1e-13);
      CHECK(std::abs(guess.v - v) < 1e-13);
    }
  }
}

TEST_CASE("an upright plate has no plan view, and its guesses come from the boxes") {
  const RigidMotion upright = motion_about({0, 0, 0}, 90, {1, 0, 0}, {5, 6, 7});
  const BSplineSurface surface = moved(upright, yard_plate());
  const auto prepared = PreparedSurface::from(surface);
  REQUIRE(!prepared->is_explicit());
  const Parameters guess = prepared->guess_of(surface.at(0.42, 0.77).value);
  CHECK(std::abs(guess.u - 0.42) < 0.1);
  CHECK(std::abs(guess.v - 0.77) < 0.1);
}

TEST_CASE("a surface that cannot be prepared is refused by name") {
  BSplineSurface surface = yard_plate();
  std::swap(surface.knots_u[6], surface.knots_u[7]);
  CHECK(PreparedSurface::from(surface).error() == Error::knots_not_increasing);
  surface = yard_plate();
  surface.z(3, 4) = std::nan("");
  CHECK(PreparedSurface::from(surface).error() == Error::not_finite);
  surface = yard_plate();
  surface.knots_v[5] = std::numeric_limits<double>::infinity();
  CHECK(PreparedSurface::from(surface).error() == Error::not_finite);
  surface = yard_plate();
  surface.knots_v.pop_back();
  CHECK(PreparedSurface::from(surface).error() == Error::too_few_points);
  surface = yard_plate();
  surface.y.conservativeResize(22, 23);
  CHECK(PreparedSurface::from(surface).error() == Error::too_few_points);
  surface = yard_plate();
  std::fill(surface.knots_u.begin(), surface.knots_u.end(), 0.5);
  CHECK(PreparedSurface::from(surface).error() == Error::knots_not_increasing);
}

TEST_CASE(
    "a prepared surface keeps less than 0.85 kB a span beside its plan table, and evaluating takes no "
    "memory") {
  const auto prepared = PreparedSurface::from(yard_plate());
  const std::size_t plan = 41 * 41 * 16;
  CHECK(prepared->bytes() - plan < 850 * 400);
  const std::size_t before = allocations();
  const SurfacePoint p = prepared->at(0.3, 0.4);
  const Parameters guess = prepared->guess_of(p.value);
  CHECK(allocations() == before);
  CHECK(guess.u > 0);
}
