#include "geometry/edges/corner_choice.hpp"

#include <doctest/doctest.h>

#include <cmath>

using namespace moldloft::geometry;
using Eigen::Vector2d;

namespace {

const std::array<Vector2d, 4> corners{Vector2d{0, 0}, {700, 40}, {640, 400}, {-60, 330}};

// Edge points every `spacing`, the boundary torn into teeth of a depth that repeats every `pitch`.
std::vector<Vector2d> torn_outline(double depth, double pitch, double spacing = 2) {
  std::vector<Vector2d> points;
  for (std::size_t i = 0; i < 4; ++i) {
    const Vector2d a = corners[i], d = corners[(i + 1) % 4] - a, along = d.normalized(),
                   out{along.y(), -along.x()};
    for (double s = spacing / 2; s < d.norm(); s += spacing) {
      const double phase = std::fmod(s, pitch) / pitch;
      points.push_back(a + s * along + depth * (phase - 0.5) * out);
    }
  }
  return points;
}

std::expected<bool, Error> run(CornerChoice& choice) {
  for (int i = 0; i < 5000; ++i) {
    const auto done = choice.step();
    if (!done || *done) return done;
  }
  return false;
}

}  // namespace

TEST_CASE("of many candidates along a torn boundary the four corners are chosen") {
  const auto edges = torn_outline(8, 17);
  std::vector<Vector2d> candidates;
  for (std::size_t i = 0; i < edges.size(); i += 23) candidates.push_back(edges[i]);  // teeth everywhere
  for (const auto& c : corners) candidates.push_back(c + Vector2d{4, -6});
  CornerChoice choice{{}};
  choice.begin(edges, candidates);
  REQUIRE(run(choice).value());
  // Counter-clockwise, beginning with one of the longer pair of sides: corner 0 or corner 2.
  const auto& found = choice.corners();
  const std::size_t shift = (found[0] - corners[0]).norm() < 20 ? 0 : 2;
  for (std::size_t i = 0; i < 4; ++i) CHECK((found[i] - corners[(i + shift) % 4]).norm() < 5);
}

TEST_CASE("on a clean boundary the corner is where the lines meet, whatever the candidate was off by") {
  const auto edges = torn_outline(0, 10);
  std::vector<Vector2d> candidates;
  for (const auto& c : corners) candidates.push_back(c + Vector2d{12, 9});
  CornerChoice choice{{}};
  choice.begin(edges, candidates);
  REQUIRE(run(choice).value());
  for (const auto& c : corners) {
    double nearest = 1e9;
    for (const auto& f : choice.corners()) nearest = std::min(nearest, (f - c).norm());
    CHECK(nearest < 1e-6);
  }
}

TEST_CASE("edge points that take more than one step to look at are all looked at") {
  auto edges = torn_outline(0, 10, 0.2);
  REQUIRE(edges.size() > 2 * 4096);
  CornerChoice choice{{}};
  choice.begin(edges, corners);  // the last corner's ring lies in the last step's points
  REQUIRE(run(choice).value());
  for (const auto& c : choice.corners()) {
    double nearest = 1e9;
    for (const auto& known : corners) nearest = std::min(nearest, (known - c).norm());
    CHECK(nearest < 1e-6);
  }
  edges.back().y() = std::nan("");
  choice.begin(edges, corners);
  CHECK(run(choice).error() == Error::not_finite);
}

TEST_CASE("a corner that nobody saw leaves three, which is not a plate of four sides") {
  const auto edges = torn_outline(0, 10);
  const std::vector<Vector2d> candidates{corners[0], corners[1], corners[2]};
  CornerChoice choice{{}};
  choice.begin(edges, candidates);
  CHECK(run(choice).error() == Error::not_four_sided);
}

TEST_CASE("no candidate at all is an error by name") {
  CornerChoice choice{{}};
  choice.begin({}, {});
  CHECK(run(choice).error() == Error::too_few_points);
}

TEST_CASE("more candidates than the plan has room for are an error by name, and none of them is left out") {
  const auto edges = torn_outline(0, 10);
  std::vector<Vector2d> candidates(60, Vector2d{200, 12});
  for (const auto& c : corners) candidates.push_back(c);
  CornerChoice enough{{.max_candidates = 64}}, too_few{{.max_candidates = 63}};
  enough.begin(edges, candidates);
  CHECK(run(enough).value());
  too_few.begin(edges, candidates);
  CHECK(run(too_few).error() == Error::capacity);
}
