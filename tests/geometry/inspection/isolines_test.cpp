#include "geometry/inspection/isolines.hpp"

#include "geometry/polynomial_surface.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <map>
#include <numbers>
#include <random>

using namespace moldloft;
using namespace moldloft::geometry;
using Eigen::Vector2d, Eigen::Vector3d;
using test::height_surface;

namespace {

constexpr double eps = std::numeric_limits<double>::epsilon();

// `count` values from `from` to `to`.
std::vector<double> steps(double from, double to, int count) {
  std::vector<double> all = even_steps(count);
  for (double& t : all) t = from + (to - from) * t;
  return all;
}

double cross(const Vector2d& a, const Vector2d& b) { return a.x() * b.y() - a.y() * b.x(); }

double signed_area(std::span<const Isolines::Vertex> loop) {
  double sum = 0;
  for (std::size_t i = 0; i < loop.size(); ++i) sum += cross(loop[i].uv, loop[(i + 1) % loop.size()].uv) / 2;
  return sum;
}

double value_at(const ScalarGrid& grid, const Vector2d& node) {
  const auto i = std::ranges::find(grid.us, node.x()) - grid.us.begin();
  const auto j = std::ranges::find(grid.vs, node.y()) - grid.vs.begin();
  return grid.values[static_cast<std::size_t>(i) * grid.vs.size() + static_cast<std::size_t>(j)];
}

}  // namespace

TEST_CASE(
    "a paraboloid's contours are circles, closed, as long as circles and with the larger values on their "
    "left") {
  const auto bowl = height_surface([](double x, double y) { return 0.01 * (x * x + y * y); }, -50, 50, 4);
  const HeightOn height{bowl};
  constexpr int nodes = 38;
  const double cell_mm = 100.0 / (nodes - 1);
  for (const double radius : {7.0, 20.0, 44.0}) {
    const double level = 0.01 * radius * radius;
    auto lines = trace_isolines(sample_field(height, even_steps(nodes), even_steps(nodes)), level);
    REQUIRE(lines.has_value());
    REQUIRE(lines->lines.size() == 1);
    const Isoline line = lines->lines[0];
    CHECK(line.closed);
    // Along an edge the second derivative is 0.02 / mm: linear crossings miss the level by cell^2 /
    // 8 of that.
    for (const Isolines::Vertex& vertex : lines->vertices) {
      CHECK(std::abs(height(vertex.uv.x(), vertex.uv.y()) - level) <= 0.02 * cell_mm * cell_mm / 8 + 1e-14);
    }
    refine_isolines(*lines, height, level);
    // The slope is at most 0.02 * 50 * sqrt(2) * 100 mm a unit of the domain; 25 mm is the net's size, 16 eps
    // the surface's rounding.
    const double allowed = 8 * eps * 142 + 16 * eps * 72;
    for (const Isolines::Vertex& vertex : lines->vertices) {
      CHECK(std::abs(height(vertex.uv.x(), vertex.uv.y()) - level) <= allowed);
      CHECK((vertex.uv.x() == vertex.from.x() || vertex.uv.y() == vertex.from.y()));  // still on its edge
    }
    const auto ring = on_surface(bowl, *lines, line);
    CHECK(ring.size() == line.count + 1);
    CHECK(ring.front() == ring.back());
    // A polygon on the circle; no chord is longer than a cell's diagonal, and a chord d is short of its arc
    // by d^3/24R^2, to which the higher orders add less than a tenth of it.
    const double circle = 2 * std::numbers::pi * radius,
                 share = 2 * cell_mm * cell_mm / (24 * radius * radius);
    CHECK(length_of(ring) <= circle * (1 + 1e-12));
    CHECK(length_of(ring) >= circle * (1 - 1.1 * share));
    CHECK(signed_area(lines->of(line)) < 0);  // larger values outside, so clockwise
  }
  CHECK(trace_isolines(sample_field(height, even_steps(nodes), even_steps(nodes)), -1.0)->lines.empty());
}

TEST_CASE("lines that leave the domain are open and end on its border") {
  const auto grid = sample_field([](double u, double v) { return u + 2 * v; }, even_steps(6), even_steps(9));
  const auto lines = trace_isolines(grid, 0.73);
  REQUIRE(lines.has_value());
  REQUIRE(lines->lines.size() == 1);
  const auto line = lines->of(lines->lines[0]);
  CHECK_FALSE(lines->lines[0].closed);
  CHECK((line.back().uv - Vector2d(0.73, 0)).norm() < 4 * eps);  // larger values on the left: towards +u, -v
  CHECK((line.front().uv - Vector2d(0, 0.365)).norm() < 4 * eps);
  for (const auto& vertex : line) CHECK(std::abs(vertex.uv.x() + 2 * vertex.uv.y() - 0.73) < 8 * eps);
}

TEST_CASE(
    "two opposite corners above the level are joined where the saddle is above it, and parted where it is "
    "below") {
  // f = (u - a)(v - b) is bilinear, so its hyperbolas are known, and so is on which branch every vertex lies.
  // The saddle (value 0) lies off the cell's middle, where the field is worth a b: a level between the two is
  // what tells a decision by the saddle from one by the middle.
  const double a = 0.2, b = 0.3;
  for (const double turn : {1.0, -1.0}) {
    const auto field = [&](double u, double v) { return turn * (u - a) * (v - b); };
    const auto grid = sample_field(field, {-1, 1}, {-1, 1});
    for (const double level : {-0.3, -0.05, -0.01, 0.01, 0.05, 0.3}) {
      CAPTURE(turn);
      CAPTURE(level);
      const auto lines = trace_isolines(grid, level);
      REQUIRE(lines.has_value());
      REQUIRE(lines->lines.size() == 2);
      for (const Isoline& line : lines->lines) {
        const auto ends = lines->of(line);
        REQUIRE(ends.size() == 2);
        for (const auto& end : ends) CHECK(field(end.uv.x(), end.uv.y()) == doctest::Approx(level));
        // One branch lies in one quadrant about the saddle.
        CHECK((ends[0].uv.x() > a) == (ends[1].uv.x() > a));
        CHECK((ends[0].uv.y() > b) == (ends[1].uv.y() > b));
      }
    }
  }
}

TEST_CASE(
    "every edge that the level crosses is passed once, by a line that closes or ends at the border or a "
    "hole") {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> unit(-1, 1);
  for (int trial = 0; trial < 40; ++trial) {
    ScalarGrid grid{steps(0, 1, 12), steps(0, 2, 9), {}};
    for (int k = 0; k < 12 * 9; ++k) grid.values.push_back(unit(random));
    if (trial % 2 == 1) grid.values[5 * 9 + 4] = grid.values[5 * 9 + 5] = NAN;
    const double level = 0.2 * unit(random);
    const auto lines = trace_isolines(grid, level);
    REQUIRE(lines.has_value());

    std::map<std::array<double, 4>, int> passed;
    std::size_t vertices = 0;
    const auto on_rim = [&](const Isolines::Vertex& vertex) {
      const bool border =
          (vertex.from.x() == vertex.to.x() && (vertex.from.x() == 0 || vertex.from.x() == 1)) ||
          (vertex.from.y() == vertex.to.y() && (vertex.from.y() == 0 || vertex.from.y() == 2));
      // Within one cell of the two nodes that hold nothing.
      const bool hole = trial % 2 == 1 && std::abs(vertex.uv.x() - grid.us[5]) <= 1.001 / 11 &&
                        vertex.uv.y() >= grid.vs[3] - 1e-9 && vertex.uv.y() <= grid.vs[6] + 1e-9;
      return border || hole;
    };
    bool open_first = true;
    for (const Isoline& line : lines->lines) {
      const auto vertex = lines->of(line);
      vertices += vertex.size();
      for (const auto& v : vertex) ++passed[{v.from.x(), v.from.y(), v.to.x(), v.to.y()}];
      open_first &= line.closed || &line == lines->lines.data() || !(&line - 1)->closed;
      if (!line.closed) {
        CHECK(on_rim(vertex.front()));
        CHECK(on_rim(vertex.back()));
      }
      const std::size_t pieces = line.closed ? vertex.size() : vertex.size() - 1;
      for (std::size_t k = 0; k < pieces; ++k) {
        const auto& here = vertex[k];
        const bool rises = value_at(grid, here.to) > value_at(grid, here.from);
        const Vector2d along = vertex[(k + 1) % vertex.size()].uv - here.uv;
        CHECK(cross(along, (rises ? here.to : here.from) - here.uv) > 0);
      }
    }
    CHECK(open_first);
    CHECK(vertices == lines->vertices.size());

    std::size_t crossed = 0;
    const auto count = [&](std::size_t p, std::size_t q, bool seen) {
      crossed += seen && (grid.values[p] >= level) != (grid.values[q] >= level);
    };
    const auto whole = [&](int i, int j) {  // the cell exists and has four values
      if (i < 0 || j < 0 || i > 10 || j > 7) return false;
      const double sum = grid.values[i * 9 + j] + grid.values[i * 9 + j + 1] + grid.values[i * 9 + j + 9] +
                         grid.values[i * 9 + j + 10];
      return !std::isnan(sum);
    };
    for (int i = 0; i < 12; ++i) {
      for (int j = 0; j < 9; ++j) {
        if (i < 11) count(i * 9 + j, i * 9 + j + 9, whole(i, j) || whole(i, j - 1));
        if (j < 8) count(i * 9 + j, i * 9 + j + 1, whole(i, j) || whole(i - 1, j));
      }
    }
    CHECK(crossed == vertices);
    CHECK(passed.size() == vertices);
  }
}

TEST_CASE("a level that nodes hit exactly gives each of them one vertex, and a summit no line") {
  // Whole numbers on the nodes: the level 3 lies on a row of them.
  const auto ramp =
      trace_isolines(sample_field([](double u, double) { return u; }, {0, 1, 2, 3, 4, 5}, {0, 1, 2, 3}), 3);
  REQUIRE(ramp->lines.size() == 1);
  REQUIRE(ramp->vertices.size() == 4);
  for (const auto& vertex : ramp->vertices) CHECK(vertex.uv.x() == 3);

  const auto peak = [](double u, double v) { return -std::abs(u - 2) - std::abs(v - 2); };
  const std::vector<double> five{0, 1, 2, 3, 4};
  CHECK(trace_isolines(sample_field(peak, five, five), 0)->lines.empty());
  const auto pit = [&](double u, double v) { return -peak(u, v); };
  CHECK(trace_isolines(sample_field(pit, five, five), 0)->lines.empty());
  const auto diamond = trace_isolines(sample_field(peak, five, five), -1);
  REQUIRE(diamond->lines.size() == 1);
  CHECK(diamond->lines[0].closed);
  CHECK(diamond->vertices.size() == 4);
  CHECK(signed_area(diamond->of(diamond->lines[0])) == 2);  // the summit on the left: counter-clockwise
}

TEST_CASE("refined vertices lie on the level as exactly as the parameter can say") {
  const auto egg = [](double u, double v) { return std::sin(9 * u) * std::cos(7 * v) + 0.1 * u; };
  int evaluations = 0;
  const auto counted = [&](double u, double v) {
    ++evaluations;
    return egg(u, v);
  };
  for (const double level : {-0.6, -0.05, 0.0, 0.3, 0.83}) {
    auto lines = trace_isolines(sample_field(egg, even_steps(30), even_steps(40)), level);
    REQUIRE(lines.has_value());
    REQUIRE(lines->vertices.size() > 50);
    evaluations = 0;
    refine_isolines(*lines, counted, level);
    CHECK(evaluations < 16 * static_cast<int>(lines->vertices.size()));
    // The largest slope along u or v is 9.1; the field's own rounding is a few eps of 1.1 and of the angles
    // 9 and 7.
    for (const auto& vertex : lines->vertices) {
      CHECK(std::abs(egg(vertex.uv.x(), vertex.uv.y()) - level) <= 8 * eps * 9.1 + 4 * eps * (1.1 + 9));
    }
  }
  // A field as steep as a wall on one side: a plain secant would creep.
  const auto wall = [](double u, double) { return std::exp(40 * u) - 2; };
  auto lines = trace_isolines(sample_field(wall, {0, 1}, {0, 1}), 0);
  refine_isolines(*lines, wall, 0);
  for (const auto& vertex : lines->vertices) CHECK(std::abs(vertex.uv.x() - std::log(2) / 40) <= 8 * eps);
}

TEST_CASE(
    "a paraboloid's isophotes under a light from above are circles whose radius is the tangent of the "
    "angle") {
  const double bend = 0.01;
  const auto bowl =
      height_surface([&](double x, double y) { return 0.5 * bend * (x * x + y * y); }, -60, 60, 3);
  for (const double angle : {0.1, 0.3, 0.5}) {
    const auto lines = isophotes(bowl, {0, 0, 7}, angle, 40, 45);
    REQUIRE(lines.has_value());
    REQUIRE(lines->lines.size() == 1);
    CHECK(lines->lines[0].closed);
    const double radius = std::tan(angle) / bend;
    // d(cos angle)/d radius is bend sin cos^2: what the cosine's rounding of 4 eps leaves open of the radius,
    // and as much again for the parameter.
    const double allowed = 8 * eps / (bend * std::sin(angle) * std::pow(std::cos(angle), 2)) + 8 * eps * 120;
    for (const Vector3d& p : on_surface(bowl, *lines, lines->lines[0])) {
      CHECK(std::abs(p.head<2>().norm() - radius) <= allowed);
    }
  }
  // From the side, a sheet bent about y shows straight lines: tan of its slope is the angle to the vertical.
  const auto sheet = height_surface([&](double x, double) { return 0.5 * bend * x * x; }, -60, 60, 2);
  const auto lines = isophotes(sheet, Vector3d(-1, 0, 0), std::numbers::pi / 2 - 0.2, 20, 20);
  REQUIRE(lines->lines.size() == 1);
  CHECK_FALSE(lines->lines[0].closed);
  for (const auto& vertex : lines->vertices)
    CHECK(-60 + 120 * vertex.uv.x() == doctest::Approx(std::tan(0.2) / bend));
}

TEST_CASE("an isoparametric line stays within the tolerance of its polyline and ends on the border") {
  const auto surface = test::polynomial_surface(
      [](double u, double v) {
        return Vector3d(100 * u, 80 * v + 5 * u * v, 20 * u * u * u - 30 * u * v * v + 10 * v * v * v);
      },
      {0, 0, 0, 0, 0.2, 0.5, 0.5, 0.8, 1, 1, 1, 1}, uniform_clamped_knots(3));
  for (const double tolerance : {1.0, 0.01, 1e-4}) {
    for (const Parameter fixed : {Parameter::u, Parameter::v}) {
      const double value = 0.37;
      const auto line = isoparametric_line(surface, fixed, value, tolerance);
      REQUIRE(line.has_value());
      const auto at = [&](double t) {
        return fixed == Parameter::u ? surface.at(value, t).value : surface.at(t, value).value;
      };
      CHECK((line->front() - at(0)).norm() < 1e-12);
      CHECK((line->back() - at(1)).norm() < 1e-12);
      double worst = 0;
      for (int k = 0; k <= 3000; ++k) {
        const Vector3d p = at(k / 3000.0);
        double nearest = 1e9;
        for (std::size_t i = 1; i < line->size(); ++i) {
          const Vector3d a = (*line)[i - 1], d = (*line)[i] - a;
          const double t = std::clamp((p - a).dot(d) / d.squaredNorm(), 0.0, 1.0);
          nearest = std::min(nearest, (a + t * d - p).norm());
        }
        worst = std::max(worst, nearest);
      }
      CHECK(worst <= tolerance);
      if (tolerance < 0.1) CHECK(worst > 0.2 * tolerance);  // and does not waste chords
    }
  }
}

TEST_CASE("grids, levels and lights that make no sense are refused by name") {
  const std::vector<double> two{0, 1};
  const auto field = [](double u, double v) { return u - v; };
  const ScalarGrid good = sample_field(field, two, two);
  ScalarGrid grid = good;
  CHECK(trace_isolines(grid, NAN).error() == Error::not_finite);
  grid.values.pop_back();
  CHECK(trace_isolines(grid, 0).error() == Error::too_few_points);
  CHECK(trace_isolines(sample_field(field, {0}, two), 0).error() == Error::too_few_points);
  CHECK(trace_isolines({}, 0).error() == Error::too_few_points);
  CHECK(trace_isolines(sample_field(field, {0, 0, 1}, two), 0).error() == Error::knots_not_increasing);
  CHECK(trace_isolines(sample_field(field, two, {1, 0}), 0).error() == Error::knots_not_increasing);
  CHECK(trace_isolines(sample_field(field, {0, NAN}, two), 0).error() == Error::not_finite);
  grid = good, grid.values[1] = INFINITY;
  CHECK(trace_isolines(grid, 0).error() == Error::not_finite);
  grid = good, grid.values[1] = NAN;  // a hole is no error
  CHECK(trace_isolines(grid, 0)->lines.empty());

  auto surface = height_surface([](double x, double) { return x * x; }, 0, 1);
  CHECK(isophotes(surface, {0, 0, 0}, 0.2, 5, 5).error() == Error::collinear);
  CHECK(isophotes(surface, {0, NAN, 1}, 0.2, 5, 5).error() == Error::not_finite);
  CHECK(isophotes(surface, {0, 0, 1}, NAN, 5, 5).error() == Error::not_finite);
  CHECK(isophotes(surface, {0, 0, 1}, 0.2, 1, 5).error() == Error::too_few_points);
  CHECK(isoparametric_line(surface, Parameter::u, 1.5, 0.1).error() == Error::outside_domain);
  CHECK(isoparametric_line(surface, Parameter::u, NAN, 0.1).error() == Error::not_finite);
  CHECK(isoparametric_line(surface, Parameter::v, 0.5, 0).error() == Error::not_finite);
  surface.y(0, 0) = NAN;
  CHECK(isoparametric_line(surface, Parameter::v, 0.5, 0.1).error() == Error::not_finite);
}
