#include "geometry/fit/moment_accumulator.hpp"

#include "geometry/fit/fit_points.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <cstring>

using namespace moldloft;
using namespace moldloft::geometry;

namespace {

test::FitPoints wave_points(int count, unsigned seed) {
  return test::fit_points(count, seed, 0.1, [](double u, double v) { return std::sin(5 * u) + v * v; });
}

bool same_bits(const MomentAccumulator& a, const MomentAccumulator& b) {
  for (int i = 0; i < a.grid().cells_u(); ++i) {
    for (int j = 0; j < a.grid().cells_v(); ++j) {
      if (std::memcmp(&a.grid().cell(i, j), &b.grid().cell(i, j), sizeof(CellMoments)) != 0) return false;
      if (a.grid().points(i, j) != b.grid().points(i, j)) return false;
    }
  }
  return true;
}

double largest_relative_difference(const MomentAccumulator& a, const MomentAccumulator& b) {
  double worst = 0;
  for (int i = 0; i < a.grid().cells_u(); ++i) {
    for (int j = 0; j < a.grid().cells_v(); ++j) {
      const CellMoments &x = a.grid().cell(i, j), &y = b.grid().cell(i, j);
      const double size = x.weight() + 1e-300;
      for (std::size_t k = 0; k < 56; ++k) worst = std::max(worst, std::abs(x.gram[k] - y.gram[k]) / size);
      for (std::size_t k = 0; k < 16; ++k) worst = std::max(worst, std::abs(x.load[k] - y.load[k]) / size);
    }
  }
  return worst;
}

}  // namespace

TEST_CASE("moments do not depend on how the points are cut into calls, to the bit") {
  const test::FitPoints points = wave_points(3000, 1);
  MomentAccumulator whole(6, 4), pieces(6, 4), portable(6, 4, {}, 0, Simd::portable);
  REQUIRE(whole.add(points.weighted()).has_value());
  for (std::size_t first = 0, size = 1; first < 3000; first += size, size = size * 2 + 1) {
    REQUIRE(pieces.add(points.part(first, std::min<std::size_t>(3000, first + size))).has_value());
  }
  REQUIRE(portable.add(points.weighted()).has_value());
  CHECK(same_bits(whole, pieces));
  CHECK(same_bits(whole, portable));
}

TEST_CASE("moments of shots merge to those of all points, in any split") {
  const test::FitPoints points = wave_points(5000, 2);
  MomentAccumulator whole(5, 5);
  REQUIRE(whole.add(points.weighted()).has_value());
  for (const std::size_t split : {1u, 17u, 2500u, 4999u}) {
    MomentAccumulator first(5, 5), second(5, 5);
    REQUIRE(first.add(points.part(0, split)).has_value());
    REQUIRE(second.add(points.part(split, 5000)).has_value());
    first.merge(second);
    // A cell holds 200 points: two orders of the same sum differ by less than 200 eps of it.
    CHECK(largest_relative_difference(whole, first) < 200 * 2.3e-16);
    CHECK(first.totals().points == 5000);
    CHECK(first.totals().weight == doctest::Approx(whole.totals().weight).epsilon(1e-13));
    CHECK(first.totals().squares == doctest::Approx(whole.totals().squares).epsilon(1e-13));
  }
}

TEST_CASE("a shot that is subtracted is forgotten up to rounding of the sums it was in") {
  const test::FitPoints kept = wave_points(2000, 3);
  // The shot that goes is a hundred times heavier: what cancels costs 100 times eps, and no more.
  test::FitPoints gone = wave_points(200'000, 4);
  MomentAccumulator alone(5, 5), all(5, 5), shot(5, 5);
  REQUIRE(alone.add(kept.columns()).has_value());
  REQUIRE(all.add(kept.columns()).has_value());
  REQUIRE(shot.add(gone.columns()).has_value());
  all.merge(shot);
  all.subtract(shot);
  CHECK(largest_relative_difference(alone, all) < 100 * 5 * 2.3e-16);
  CHECK(largest_relative_difference(alone, all) > 0);  // not free
  CHECK(all.totals().points == 2000);

  // Rounding leaves something of (a + b + c) - b - a - c, but nothing of a cell without points.
  MomentAccumulator empty(5, 5), sum(5, 5), third(5, 5);
  REQUIRE(third.add(wave_points(333, 14).columns()).has_value());
  for (const auto* part : {&alone, &shot, &third}) sum.merge(*part);
  for (const auto* part : {&shot, &alone, &third}) sum.subtract(*part);
  CHECK(same_bits(sum, empty));
}

TEST_CASE("float and strided columns give the moments of the same numbers as doubles") {
  const test::FitPoints points = wave_points(777, 5);
  std::vector<float> u(points.u.begin(), points.u.end());
  std::vector<double> u_rounded(u.begin(), u.end());
  std::vector<double> rows;
  for (std::size_t i = 0; i < 777; ++i) rows.insert(rows.end(), {points.v[i], points.z[i], NAN});
  MomentAccumulator dense(4, 4), mixed(4, 4);
  REQUIRE(dense.add({.u = u_rounded, .v = points.v, .z = points.z}).has_value());
  REQUIRE(mixed.add({.u = u, .v = {rows.data(), 777, 3}, .z = {rows.data() + 1, 777, 3}}).has_value());
  CHECK(same_bits(dense, mixed));
}

TEST_CASE("the first bad point is named, and those before it are in") {
  const test::FitPoints good = wave_points(500, 6);
  const auto refused = [&](auto&& spoil, std::size_t at) {
    test::FitPoints bad = good;
    spoil(bad, at);
    spoil(bad, std::size_t{480});
    MomentAccumulator moments(4, 4), before(4, 4);
    const auto added = moments.add(bad.weighted());
    REQUIRE_FALSE(added.has_value());
    CHECK(added.error().where == at);
    REQUIRE(before.add(good.part(0, at)).has_value());
    CHECK(same_bits(moments, before));
    return added.error().error;
  };
  for (const std::size_t at : {0u, 5u, 127u, 128u, 300u}) {
    CHECK(refused([](auto& p, std::size_t i) { p.u[i] = NAN; }, at) == Error::not_finite);
    CHECK(refused([](auto& p, std::size_t i) { p.z[i] = INFINITY; }, at) == Error::not_finite);
    CHECK(refused([](auto& p, std::size_t i) { p.w[i] = NAN; }, at) == Error::not_finite);
    CHECK(refused([](auto& p, std::size_t i) { p.w[i] = -0.1; }, at) == Error::negative_weight);
    CHECK(refused([](auto& p, std::size_t i) { p.v[i] = 1.001; }, at) == Error::outside_domain);
    CHECK(refused([](auto& p, std::size_t i) { p.u[i] = -0.001; }, at) == Error::outside_domain);
  }
}

TEST_CASE("the ends of any domain belong to its last cells") {
  const FitDomain domain{-0.1, 0.2, 1e3 + 0.1, 1e3 + 0.7};  // numbers that binary fractions miss
  MomentAccumulator moments(7, 3, domain);
  const double u[] = {domain.min_u, domain.max_u, 0.05}, v[] = {domain.max_v, domain.min_v, 1000.4},
               z[] = {1, 1, 1};
  REQUIRE(moments.add({.u = u, .v = v, .z = z}).has_value());
  CHECK(moments.grid().points(0, 2) == 1);
  CHECK(moments.grid().points(6, 0) == 1);
}

TEST_CASE("cells of uneven knots are found as by search") {
  std::vector<double> knots{0, 0, 0, 0, 0.001, 0.002, 0.3, 0.3, 0.7, 0.99, 1, 1, 1, 1};
  REQUIRE(check_net_knots(knots).has_value());
  const SpanTable table(knots);
  CHECK(table.spans() == 6);
  const KnotCells& cells = table.cells();
  std::mt19937 random(7);
  std::uniform_real_distribution<double> unit(0, 1);
  for (int i = 0; i < 20'000; ++i) {
    const double t = i < 8    ? table[i % 6].begin
                     : i < 20 ? table[i % 6].end
                              : unit(random) * (i % 3 == 0 ? 0.004 : 1);
    const int cell = cells.locate(t);
    CHECK(table[cell].first + 3 == find_span(knots, t));
    CHECK(cells.local(cell, t) ==
          doctest::Approx((t - table[cell].begin) / (table[cell].end - table[cell].begin)));
  }
}

TEST_CASE("knots that cannot carry a cubic net are named") {
  const auto failure = [](std::vector<double> knots) { return check_net_knots(knots).error(); };
  CHECK(failure({0, 0, 0, 0, 1, 1, 1}) == Flaw{Error::knots_wrong_count, 7});
  CHECK(failure({0, 0, 0, 0, 0.5, 0.4, 1, 1, 1, 1}) == Flaw{Error::knots_not_increasing, 5});
  CHECK(failure({0, 0, 0, 0, NAN, 0.4, 1, 1, 1, 1}) == Flaw{Error::not_finite, 4});
  CHECK(failure({0, 0, 0, 0.1, 0.5, 1, 1, 1, 1}) == Flaw{Error::knots_not_clamped, 3});
  CHECK(failure({0, 0, 0, 0, 0.5, 0.5, 0.5, 0.5, 1, 1, 1, 1}) == Flaw{Error::knot_too_often, 7});
  CHECK(failure({0, 0, 0, 0, 0.5, 1, 1, 1, 1, 1}) == Flaw{Error::knot_too_often, 9});
  CHECK(check_net_knots(std::vector<double>{0, 0, 0, 0, 0.5, 0.5, 0.5, 1, 1, 1, 1}).has_value());
}
