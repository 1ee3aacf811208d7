#include "geometry/fit/net_search.hpp"

#include "geometry/fit/moment_accumulator.hpp"
#include "geometry/heap_watch.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

using namespace moldloft;
using geometry::Error, geometry::MomentAccumulator, geometry::NetSearch, geometry::SplineNet;

namespace {

constexpr int finest_spans = 16;
constexpr double whole = std::numeric_limits<double>::max();

MomentAccumulator wavy_moments(int points) {
  MomentAccumulator moments(finest_spans, finest_spans);
  std::vector<double> u, v, z;
  for (int k = 0; k < points; ++k) {
    // A rank-one lattice: spread evenly at any number of points.
    u.push_back(std::fmod(0.5 + k * 0.7548776662466927, 1));
    v.push_back(std::fmod(0.5 + k * 0.5698402909980532, 1));
    z.push_back(std::sin(7 * u.back()) * std::cos(5 * v.back()) + 0.01 * std::sin(1e3 * k));
  }
  REQUIRE(moments.add({.u = u, .v = v, .z = z}).has_value());
  return moments;
}

geometry::NetTask model_over(const MomentAccumulator& moments, double fairing = 1e-5) {
  geometry::NetTask model;
  model.totals = moments.totals(), model.fairing = fairing;
  return model;
}

}  // namespace

TEST_CASE("however its steps are cut, a search solves the same nets and takes the same one") {
  const MomentAccumulator moments = wavy_moments(4000);
  NetSearch at_once(SplineNet(finest_spans, finest_spans), {});
  REQUIRE(at_once.start(moments.grid(), model_over(moments)).has_value());
  REQUIRE(at_once.finish().has_value());
  CHECK(at_once.progress() == 1);
  for (const double budget : {1.0, 700.0, 20'000.0}) {
    NetSearch in_steps(SplineNet(finest_spans, finest_spans), {});
    REQUIRE(in_steps.start(moments.grid(), model_over(moments)).has_value());
    int steps = 0;
    double progress = 0;
    for (auto ready = in_steps.step(budget); !*ready; ready = in_steps.step(budget), ++steps) {
      REQUIRE(ready.has_value());
      CHECK(in_steps.progress() >= progress);
      progress = in_steps.progress();
    }
    CHECK(steps > 10);
    CHECK(in_steps.chosen_place() == at_once.chosen_place());
    REQUIRE(in_steps.candidates().size() == 3);
    for (std::size_t k = 0; k < 3; ++k) {
      CHECK(in_steps.candidates()[k].coefficients == at_once.candidates()[k].coefficients);
      CHECK(in_steps.scores()[k].gcv == doctest::Approx(at_once.scores()[k].gcv).epsilon(1e-9));
    }
  }
}

TEST_CASE("a search can be started again over other points, and remembers nothing") {
  const MomentAccumulator first = wavy_moments(4000), second = wavy_moments(500), none = wavy_moments(0);
  NetSearch again(SplineNet(finest_spans, finest_spans), {}),
      fresh(SplineNet(finest_spans, finest_spans), {});
  REQUIRE(again.start(first.grid(), model_over(first)).has_value());
  REQUIRE(again.finish().has_value());
  CHECK(again.scores().size() == 3);
  CHECK(again.start(none.grid(), model_over(none)).error() == geometry::Flaw{Error::too_few_points, 0});
  CHECK(again.step(whole).error() == geometry::Flaw{Error::too_few_points, 0});
  for (NetSearch* search : {&again, &fresh}) {
    REQUIRE(search->start(second.grid(), model_over(second)).has_value());
    REQUIRE(search->finish().has_value());
    // 19 x 19 control points want 1,444 points, 11 x 11 want 484.
    CHECK(search->scores().size() == 2);
    CHECK(search->scores().front().spans_u == 8);
  }
  CHECK(again.chosen().coefficients == fresh.chosen().coefficients);
}

TEST_CASE("a net between is found at its place, and the chosen one can be solved once more") {
  const MomentAccumulator moments = wavy_moments(4000);
  NetSearch search(SplineNet(finest_spans, finest_spans), {});
  REQUIRE(search.start(moments.grid(), model_over(moments)).has_value());
  REQUIRE(search.finish().has_value());
  const std::vector<int> at{0, 3, 5, 8, 11, 13, 16};  // six spans
  std::vector<double> knots(3, 0.0);
  for (const int k : at) knots.push_back(k / 16.0);
  knots.insert(knots.end(), 3, 1.0);
  search.also_try(SplineNet(knots, knots), at, at);
  REQUIRE(search.finish().has_value());
  REQUIRE(search.scores().size() == 4);
  const int spans[] = {16, 8, 6, 4};
  for (std::size_t k = 0; k < 4; ++k) CHECK(search.scores()[k].spans_u == spans[k]);

  const std::vector<double> before = search.chosen().coefficients;
  search.solve_again();
  REQUIRE(search.finish().has_value());
  CHECK(search.chosen().coefficients == before);
  CHECK(std::ranges::equal(search.solver().coefficients(), before));
}

TEST_CASE("cells without points are named where nothing fairs the surface over them") {
  MomentAccumulator moments = wavy_moments(4000), hole(finest_spans, finest_spans);
  std::vector<double> u, v, z;
  for (int k = 0; k < 4000; ++k) {
    u.push_back(std::fmod(k * 0.7548776662466927, 1)), v.push_back(std::fmod(k * 0.5698402909980532, 1));
    z.push_back(0);
    if (u.back() >= 2 / 16.0 && u.back() <= 3 / 16.0 && v.back() >= 5 / 16.0 && v.back() <= 6 / 16.0)
      u.pop_back(), v.pop_back(), z.pop_back();
  }
  REQUIRE(hole.add({.u = u, .v = v, .z = z}).has_value());
  NetSearch search(SplineNet(finest_spans, finest_spans), {});
  REQUIRE(search.start(hole.grid(), model_over(hole, 0)).has_value());
  CHECK(search.finish().error() == geometry::Flaw{Error::empty_cells, 2 * finest_spans + 5});
  REQUIRE(search.start(moments.grid(), model_over(moments, 0)).has_value());
  CHECK(search.finish().has_value());
}

TEST_CASE("shrinking takes no memory and gives none back, from the first time on") {
  NetSearch search(SplineNet(32, 16), {.shrinks = true});
  const std::size_t taken = test::allocations(), given = test::releases();
  for (const auto& [u, v] : {std::pair(8, 16), std::pair(4, 4), std::pair(16, 32), std::pair(32, 16)})
    search.shrink_to(u, v);
  const std::size_t taken_after = test::allocations(), given_after = test::releases();
  CHECK(taken_after == taken);
  CHECK(given_after == given);
}

TEST_CASE("a search that has shrunk is one that was made so") {
  NetSearch shrinking(SplineNet(32, 16), {.shrinks = true});
  for (const auto& [u, v] : {std::pair(8, 16), std::pair(4, 4), std::pair(16, 32), std::pair(16, 8)}) {
    MomentAccumulator moments(u, v);
    std::vector<double> columns[3];
    for (int k = 0; k < 4000; ++k) {
      columns[0].push_back(std::fmod(0.5 + k * 0.7548776662466927, 1));
      columns[1].push_back(std::fmod(0.5 + k * 0.5698402909980532, 1));
      columns[2].push_back(std::sin(7 * columns[0].back()) * std::cos(5 * columns[1].back()));
    }
    REQUIRE(moments.add({.u = columns[0], .v = columns[1], .z = columns[2]}).has_value());
    NetSearch made_so(SplineNet(u, v), {});
    shrinking.shrink_to(u, v);
    for (NetSearch* search : {&shrinking, &made_so}) {
      REQUIRE(search->start(moments.grid(), model_over(moments)).has_value());
      REQUIRE(search->finish().has_value());
    }
    REQUIRE(shrinking.candidates().size() == made_so.candidates().size());
    CHECK(shrinking.scores().size() == made_so.scores().size());
    for (std::size_t k = 0; k < made_so.candidates().size(); ++k) {
      CHECK(shrinking.candidates()[k].coefficients == made_so.candidates()[k].coefficients);
    }
    CHECK(shrinking.chosen_place() == made_so.chosen_place());
  }
}
