#include "geometry/edges/outline.hpp"

#include "geometry/heap_watch.hpp"

#include <doctest/doctest.h>

#include <chrono>
#include <cmath>
#include <random>

using namespace moldloft;
using Eigen::Vector2d;
using geometry::Error, geometry::Outline, geometry::OutlineBuilder;

namespace {

// Four corners, and every side bent to the right of its chord by sagitta * 4 t (1 - t), a parabola.
struct Shape {
  std::array<Vector2d, 4> corners;
  double sagitta = 0;
  Vector2d at(int side, double t) const {
    const Vector2d a = corners[side], d = corners[(side + 1) % 4] - a;
    return a + t * d + 4 * t * (1 - t) * sagitta * Vector2d(d.y(), -d.x()).normalized();
  }
};

std::vector<Vector2d> edge_points(const Shape& shape, int a_side, double noise, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> off(0, noise);
  std::uniform_real_distribution<double> along(0, 1);
  std::vector<Vector2d> points;
  for (int side = 0; side < 4; ++side) {
    for (int i = 0; i < a_side; ++i)
      points.push_back(shape.at(side, along(random)) + Vector2d(off(random), off(random)));
  }
  return points;
}

std::array<Vector2d, 4> hints(const Shape& shape, double error, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> off(0, error);
  std::array<Vector2d, 4> hints = shape.corners;
  for (Vector2d& hint : hints) hint += Vector2d(off(random), off(random));
  return hints;
}

std::expected<void, Error> build(OutlineBuilder& builder, const std::vector<Vector2d>& points,
                                 std::span<const Vector2d> hints) {
  if (const auto begun = builder.begin(points, hints); !begun) return begun;
  for (int steps = 0; steps < 100'000; ++steps) {
    const auto ready = builder.step();
    if (!ready) return std::unexpected(ready.error());
    if (*ready) return {};
  }
  return std::unexpected(Error::singular);
}

struct Errors {
  double corner = 0, curve_max = 0, curve_rms = 0;
};

// Distances of the fitted sides from the true ones, both sampled: a dense polyline of the truth
// is the referee.
Errors compare(const Outline& outline, const Shape& shape) {
  Errors errors;
  int count = 0;
  for (int side = 0; side < 4; ++side) {
    errors.corner = std::max(errors.corner, (outline.corners[side] - shape.corners[side]).norm());
    for (double t = 0; t <= 1; t += 0.01) {
      const Vector2d p = outline.sides[side].at(t).value;
      double least = 1e9;
      for (double s = -0.02; s <= 1.02; s += 0.0005) {
        const Vector2d a = shape.at(side, s), d = (shape.at(side, s + 0.0005) - a).normalized();
        const Vector2d r = p - a;
        if (r.dot(d) >= -0.5 && r.dot(d) <= 1.5)
          least = std::min(least, std::abs(d.x() * r.y() - d.y() * r.x()));
      }
      errors.curve_max = std::max(errors.curve_max, least);
      errors.curve_rms += least * least, ++count;
    }
  }
  errors.curve_rms = std::sqrt(errors.curve_rms / count);
  return errors;
}

const Shape plate{{Vector2d(10, 20), {310, 50}, {290, 340}, {-20, 310}}};

}  // namespace

TEST_CASE("exact points give the exact outline, straight or bent, from hints that are millimetres off") {
  for (const double sagitta : {0.0, 4.0, -6.0}) {
    Shape shape = plate;
    shape.sagitta = sagitta;
    OutlineBuilder builder(2000, {.noise_mm = 1e-4});
    REQUIRE(build(builder, edge_points(shape, 300, 0, 1), hints(shape, 2, 1)).has_value());
    const Errors errors = compare(builder.outline(), shape);
    CAPTURE(sagitta);
    CHECK(errors.corner < 2e-3);
    CHECK(errors.curve_max < 2e-3);
    CHECK(builder.outline().rms_mm < 1e-3);
  }
}

TEST_CASE("with 150 points a side and 0.1 mm of noise, corners keep to 0.1 mm and sides to 0.05 mm") {
  for (const double sagitta : {0.0, 5.0}) {
    double worst_corner = 0, worst_curve = 0, rms = 0;
    int good_corners = 0;
    constexpr int seeds = 20;
    for (unsigned seed = 1; seed <= seeds; ++seed) {
      Shape shape = plate;
      shape.sagitta = sagitta;
      OutlineBuilder builder(2000, {});
      REQUIRE(build(builder, edge_points(shape, 150, 0.1, seed), hints(shape, 2, seed)).has_value());
      const Errors errors = compare(builder.outline(), shape);
      worst_corner = std::max(worst_corner, errors.corner),
      worst_curve = std::max(worst_curve, errors.curve_max);
      rms += errors.curve_rms * errors.curve_rms / seeds;
      good_corners += errors.corner < 0.1;
      CHECK(builder.outline().rms_mm == doctest::Approx(0.1).epsilon(0.15));
    }
    MESSAGE("sagitta " << sagitta << ": worst corner " << worst_corner << ", sides rms " << std::sqrt(rms)
                       << ", worst " << worst_curve << " mm");
    CHECK(std::sqrt(rms) < 0.03);
    // A parabola through 150 points has an end good to 3 sigma / sqrt(150) = 0.025 mm: of 80 corners, each
    // made of two such ends, the worst lies near 0.1 mm whoever fits.
    CHECK(good_corners >= seeds - 3);
    CHECK(worst_corner < 0.15);
    CHECK(worst_curve < 0.15);
  }
}

TEST_CASE("a tenth of false points moves the outline by less than 0.05 mm") {
  std::vector<Vector2d> points = edge_points(plate, 150, 0.1, 3);
  std::mt19937 random(9);
  std::uniform_real_distribution<double> x(0, 290), y(40, 320), inward(0.5, 4);
  for (int i = 0; i < 60; ++i) {
    if (i % 2)
      points.push_back({x(random), y(random)});
    else
      points[i * 10] += Vector2d(inward(random), inward(random));
  }
  OutlineBuilder builder(2000, {});
  REQUIRE(build(builder, points, hints(plate, 2, 3)).has_value());
  const Errors errors = compare(builder.outline(), plate);
  CHECK(errors.corner < 0.12);
  CHECK(errors.curve_max < 0.12);
}

TEST_CASE("sides of 100 and of 1500 mm, and a gap of a third of a side, stay calm") {
  const Shape strip{{Vector2d(0, 0), {1500, 30}, {1480, 130}, {-10, 100}}};
  OutlineBuilder builder(4000, {});
  REQUIRE(build(builder, edge_points(strip, 300, 0.1, 4), hints(strip, 2, 4)).has_value());
  CHECK(compare(builder.outline(), strip).corner < 0.12);
  CHECK(compare(builder.outline(), strip).curve_max < 0.12);

  std::vector<Vector2d> points = edge_points(plate, 150, 0.1, 5);
  std::erase_if(points, [](const Vector2d& p) { return p.y() < 60 && p.x() > 100 && p.x() < 200; });
  REQUIRE(build(builder, points, hints(plate, 2, 5)).has_value());
  CHECK(compare(builder.outline(), plate).curve_max < 0.15);
}

TEST_CASE("what is no outline is refused by name") {
  OutlineBuilder builder(1000, {});
  const std::vector<Vector2d> points = edge_points(plate, 100, 0.1, 6);
  CHECK(builder.begin(points, std::span(plate.corners).first(3)).error() == Error::not_four_sided);
  CHECK(builder.begin(std::span(points).first(10), plate.corners).error() == Error::too_few_points);
  CHECK(builder.begin(edge_points(plate, 300, 0.1, 6), plate.corners).error() == Error::capacity);
  const std::array<Vector2d, 4> line{Vector2d(0, 0), {1, 0}, {2, 0}, {3, 0}};
  CHECK(builder.begin(points, line).error() == Error::collinear);
  std::array<Vector2d, 4> holes = plate.corners;
  holes[2].x() = NAN;
  CHECK(builder.begin(points, holes).error() == Error::not_finite);
  const std::vector<Vector2d> three_sides(points.begin(), points.begin() + 300);
  CHECK(build(builder, three_sides, plate.corners).error() == Error::too_few_points);
  CHECK(OutlineBuilder(10, {}).step().error() == Error::too_few_points);
}

TEST_CASE("building the outline takes no memory and no long step") {
  const std::vector<Vector2d> points = edge_points(plate, 400, 0.1, 7);
  OutlineBuilder builder(2000, {});
  const auto corner_hints = hints(plate, 2, 7);
  const std::size_t before = test::allocations();
  double longest = 0;
  bool ready = !builder.begin(points, corner_hints).has_value();
  while (!ready) {
    const auto start = std::chrono::steady_clock::now();
    ready = builder.step().value_or(true);
    longest = std::max(
        longest, std::chrono::duration<double, std::micro>(std::chrono::steady_clock::now() - start).count());
  }
  const std::size_t after = test::allocations();
  CHECK(after == before);
  MESSAGE("longest step " << longest << " us");
}
