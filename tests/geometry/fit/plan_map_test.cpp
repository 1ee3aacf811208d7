#include "geometry/fit/plan_map.hpp"

#include "geometry/heap_watch.hpp"
#include "geometry/outline_shapes.hpp"

#include <doctest/doctest.h>

#include <chrono>
#include <cmath>
#include <random>

using namespace moldloft;
using Eigen::Vector2d;
using geometry::Error, geometry::Outline, geometry::PlanCurve, geometry::PlanMap;
using test::bent_outline, test::straight_outline;

TEST_CASE("a parallelogram's map is affine") {
  const PlanMap map(straight_outline({Vector2d(10, 20), {310, 50}, {330, 350}, {30, 320}}));
  for (double u = 0; u <= 1; u += 0.1) {
    for (double v = 0; v <= 1; v += 0.1) {
      const Vector2d truth = Vector2d(10, 20) + u * Vector2d(300, 30) + v * Vector2d(20, 300);
      CHECK((map.at(u, v).value - truth).norm() < 1e-11);
      CHECK((map.at(u, v).jacobian.col(0) - Vector2d(300, 30)).norm() < 1e-9);
      CHECK((map.at(u, v).jacobian.col(1) - Vector2d(20, 300)).norm() < 1e-9);
    }
  }
  CHECK(map.check().has_value());
}

TEST_CASE("the map's rim is the outline, and its Jacobian the limit of differences") {
  const Outline outline = bent_outline();
  const PlanMap map(outline);
  for (double t = 0; t <= 1; t += 0.05) {
    CHECK((map.at(t, 0).value - outline.sides[0].at(t).value).norm() < 1e-11);
    CHECK((map.at(1, t).value - outline.sides[1].at(t).value).norm() < 1e-11);
    CHECK((map.at(1 - t, 1).value - outline.sides[2].at(t).value).norm() < 1e-11);
    CHECK((map.at(0, 1 - t).value - outline.sides[3].at(t).value).norm() < 1e-11);
  }
  const double h = 1e-6;
  for (const auto& [u, v] : {std::pair{0.3, 0.4}, {0.77, 0.13}, {1.02, 0.5}, {-0.01, 1.01}}) {
    const Vector2d du = (map.at(u + h, v).value - map.at(u - h, v).value) / (2 * h);
    const Vector2d dv = (map.at(u, v + h).value - map.at(u, v - h).value) / (2 * h);
    CHECK((map.at(u, v).jacobian.col(0) - du).norm() < 1e-5);
    CHECK((map.at(u, v).jacobian.col(1) - dv).norm() < 1e-5);
  }
}

TEST_CASE("inverting gives back the parameters, from any guess") {
  const PlanMap map(bent_outline());
  REQUIRE(map.check().has_value());
  std::mt19937 random(1);
  std::uniform_real_distribution<double> unit(0, 1);
  for (int i = 0; i < 5000; ++i) {
    const Vector2d uv(unit(random), unit(random)), guess(unit(random), unit(random));
    const auto back = map.invert(map.at(uv.x(), uv.y()).value, guess);
    REQUIRE(back.has_value());
    CHECK((*back - uv).norm() < 1e-12);
  }
}

TEST_CASE("a point beside the plate belongs to it only within the margin") {
  const PlanMap map(straight_outline({Vector2d(0, 0), {100, 0}, {100, 100}, {0, 100}}));
  CHECK(map.invert({101, 50}, {0.5, 0.5}).error() == Error::outside_domain);
  CHECK(map.invert({101, 50}, {0.5, 0.5}, 0.005).error() == Error::outside_domain);
  const auto beside = map.invert({101, 50}, {0.5, 0.5}, 0.02);
  REQUIRE(beside.has_value());
  CHECK(beside->x() == doctest::Approx(1.01));
  CHECK(map.invert({1e6, 50}, {0.5, 0.5}, 0.02).error() == Error::outside_domain);
  CHECK(map.invert({NAN, 50}, {0.5, 0.5}).error() == Error::not_finite);
}

TEST_CASE("an outline that folds over itself is refused") {
  CHECK(PlanMap(straight_outline({Vector2d(0, 0), {100, 0}, {20, 20}, {0, 100}})).check().error() ==
        Error::folded_map);
}

TEST_CASE("the net is the map, exactly, over any knots that refine the sides'") {
  const PlanMap map(bent_outline());
  const std::vector<double> uneven{0, 0, 0, 0, 0.1, 0.25, 0.4, 0.5, 0.5, 0.75, 0.8, 1, 1, 1, 1};
  geometry::BSplineSurface surface;
  for (const auto& [ku, kv] :
       {std::pair{geometry::uniform_clamped_knots(4), geometry::uniform_clamped_knots(16)},
        {uneven, geometry::uniform_clamped_knots(8)}}) {
    surface.knots_u = ku, surface.knots_v = kv;
    map.to_net(surface);
    surface.z = Eigen::MatrixXd::Zero(surface.x.rows(), surface.x.cols());
    double worst = 0;
    for (double u = 0; u <= 1; u += 0.03) {
      for (double v = 0; v <= 1; v += 0.03) {
        worst = std::max(worst, (surface.at(u, v).value.head<2>() - map.at(u, v).value).norm());
      }
    }
    CHECK(worst < 1e-11);
  }
}

TEST_CASE(
    "a batch of neighbours has the parameters of its points one by one, and the same bits on every vector "
    "unit") {
  const PlanMap map(bent_outline());
  std::vector<double> x, y;
  // Stripes across the plate and beyond its sides, across the sides' spans, and one point that is none.
  for (int i = 0; i < 5003; ++i) {
    const double t = std::fmod(i * 0.00071, 1.04) - 0.02, s = std::fmod(i * 0.0123 + 0.3, 1.0);
    const Vector2d p = map.at(t, s).value;
    x.push_back(p.x()), y.push_back(p.y());
  }
  x[1001] = NAN, y[2002] = INFINITY;
  std::vector<double> first;
  for (const auto simd : {geometry::Simd::portable, geometry::Simd::avx2, geometry::Simd::avx512}) {
    if (!geometry::machine_has(simd)) continue;
    std::vector<double> u(x.size()), v(x.size());
    Vector2d guess(0.5, 0.5), one_guess(0.5, 0.5);
    const std::size_t off = map.invert(x, y, u, v, guess, 0.0, simd);
    std::size_t off_alone = 0;
    for (std::size_t i = 0; i < x.size(); ++i) {
      const auto alone = map.invert({x[i], y[i]}, one_guess);
      off_alone += !alone;
      REQUIRE(std::isnan(u[i]) == !alone.has_value());
      if (!alone) continue;
      one_guess = *alone;
      CHECK(std::abs(u[i] - alone->x()) < 1e-12);
      CHECK(std::abs(v[i] - alone->y()) < 1e-12);
      CHECK((map.at(u[i], v[i]).value - Vector2d(x[i], y[i])).norm() < 1e-10);
    }
    CHECK(off == off_alone);
    CHECK(off > 100);
    u.insert(u.end(), v.begin(), v.end());
    std::erase_if(u, [](double value) { return std::isnan(value); });
    if (first.empty()) first = u;
    CHECK(first == u);
  }
}

TEST_CASE("inverting a point beside the last takes a fraction of a microsecond and no memory") {
  const PlanMap map(bent_outline());
  std::vector<Vector2d> points;
  for (int i = 0; i < 500; ++i) points.push_back({60 + 0.2 * i, 100 + 0.1 * i});
  const std::size_t before = test::allocations();
  double least = 1e9, sum = 0;
  for (int repeat = 0; repeat < 50; ++repeat) {
    Vector2d uv(0.5, 0.5);
    const auto start = std::chrono::steady_clock::now();
    for (const Vector2d& p : points) {
      uv = map.invert(p, uv).value_or(uv);
      sum += uv.x();
    }
    least = std::min(
        least, std::chrono::duration<double, std::nano>(std::chrono::steady_clock::now() - start).count());
  }
  const std::size_t after = test::allocations();
  CHECK(after == before);
  CHECK(sum > 0);
  MESSAGE((least / 500) << " ns a point");
}
