#include "geometry/splines/trimmed_surface.hpp"

#include "geometry/cad/sample_faces.hpp"

#include <doctest/doctest.h>

#include <limits>

using namespace moldloft;
using namespace moldloft::geometry;
using Eigen::Vector2d, Eigen::Vector3d;

namespace {

constexpr double tolerance_mm = 1e-5;

Error fault(const TrimmedSurface& face) {
  const auto checked = check(face, tolerance_mm);
  REQUIRE_FALSE(checked.has_value());
  return checked.error();
}

}  // namespace

TEST_CASE("the natural border runs counter-clockwise, and its images are the surface on it") {
  for (const auto& s : {test::bent_plate(), test::uneven_plate()}) {
    const TrimLoop border = natural_border(s);
    REQUIRE(border.size() == 4);
    const Vector2d low(s.knots_u.front(), s.knots_v.front()), high(s.knots_u.back(), s.knots_v.back());
    const std::vector<Vector2d> corner = {low, {high.x(), low.y()}, high, {low.x(), high.y()}};
    const double size =
        std::max({s.x.cwiseAbs().maxCoeff(), s.y.cwiseAbs().maxCoeff(), s.z.cwiseAbs().maxCoeff()});
    for (std::size_t i = 0; i < 4; ++i) {
      const auto& curve = border[i];
      const auto& control = curve.path.control;
      CHECK(((curve.reversed ? control.back() : control.front()) - corner[i]).norm() < 1e-14);
      CHECK(((curve.reversed ? control.front() : control.back()) - corner[(i + 1) % 4]).norm() < 1e-14);
      for (int k = 0; k <= 40; ++k) {
        const double a = curve.path.knots.front(), b = curve.path.knots.back(), t = a + (b - a) * k / 40;
        const Vector2d uv = curve.path.at(t).value;
        CHECK(uv[i % 2] == doctest::Approx(t).epsilon(1e-14));  // unit speed
        // Two evaluations, each within 16 eps of the net's size; the path's rounding adds as much.
        CHECK((curve.image->value(t) - s.at(uv.x(), uv.y()).value).norm() <= 64 * 2.3e-16 * size);
      }
    }
    CHECK(check({.surface = s, .outer = border}, tolerance_mm).has_value());
  }
}

TEST_CASE("the image of a path stays within the tolerance asked for, and meets its ends") {
  const auto face = test::trimmed_plate();
  std::size_t coarser = 0;
  for (const double tolerance : {1e-2, 1e-4, 1e-6}) {
    std::size_t control = 0;
    for (const TrimLoop& loop : {face.outer, face.holes[0], face.holes[1]}) {
      for (const auto& curve : loop) {
        const SpaceCurve image = image_on(face.surface, curve.path, tolerance);
        control += image.control.size();
        const double a = curve.path.knots.front(), b = curve.path.knots.back();
        double worst = 0;
        for (int k = 0; k <= 5000; ++k) {
          const double t = a + (b - a) * k / 5000;
          const Vector2d uv = curve.path.at(t).value;
          worst = std::max(worst, (image.value(t) - face.surface.at(uv.x(), uv.y()).value).norm());
        }
        CHECK(worst <= tolerance);
        for (const double t : {a, b}) {
          const Vector2d uv = curve.path.at(t).value;
          CHECK((image.value(t) - face.surface.at(uv.x(), uv.y()).value).norm() < 1e-12);
        }
      }
    }
    CHECK(control > coarser);  // a finer tolerance takes more pieces
    coarser = control;
  }
}

TEST_CASE("on a plane the image of a path is the path itself, and takes no more pieces than it has") {
  BSplineSurface plane =
      test::surface_over(test::straight_outline({Vector2d(0, 0), {200, 0}, {200, 100}, {0, 100}}), 4, 4,
                         [](double x, double y) { return 3 + 0.5 * x - 0.25 * y; });
  const PlanCurve path = test::ellipse({0.5, 0.5}, 0.3, 0.2, false);
  const SpaceCurve image = image_on(plane, path, 1e-6);
  CHECK(image.control.size() == path.control.size());
  for (int k = 0; k <= 100; ++k) {
    const Vector2d uv = path.at(k / 100.0).value;
    const Vector3d truth(200 * uv.x(), 100 * uv.y(), 3 + 100 * uv.x() - 25 * uv.y());
    CHECK((image.value(k / 100.0) - truth).norm() < 1e-11);
  }
}

TEST_CASE("a curve turned round runs through the same points") {
  const PlanCurve path = test::ellipse({0.5, 0.5}, 0.3, 0.2, false), back = reversed(path);
  for (int k = 0; k <= 50; ++k) CHECK((path.at(k / 50.0).value - back.at(1 - k / 50.0).value).norm() < 1e-15);
}

TEST_CASE("a face that is well formed passes, with holes, with reversed curves, with images") {
  auto face = test::trimmed_plate();
  CHECK(check(face, tolerance_mm).has_value());
  for (auto& curve : face.outer) curve.image = image_on(face.surface, curve.path, tolerance_mm);
  CHECK(check(face, tolerance_mm).has_value());
  face.outer.clear();
  CHECK(check(face, tolerance_mm).has_value());
}

TEST_CASE("what is wrong with a face is told by its name") {
  const auto good = test::trimmed_plate();
  auto face = good;
  SUBCASE("a pole that is no number") {
    face.surface.y(2, 2) = std::numeric_limits<double>::quiet_NaN();
    CHECK(fault(face) == Error::not_finite);
  }
  SUBCASE("a knot that is no number") {
    face.surface.knots_v[5] = std::numeric_limits<double>::quiet_NaN();
    CHECK(fault(face) == Error::not_finite);
  }
  SUBCASE("knots that decrease") {
    std::swap(face.surface.knots_u[4], face.surface.knots_u[5]);
    CHECK(fault(face) == Error::knots_not_increasing);
  }
  SUBCASE("knots that are not clamped") {
    face.surface.knots_u[0] -= 1;
    CHECK(fault(face) == Error::knots_not_increasing);
  }
  SUBCASE("a path whose knots do not fit its poles") {
    face.outer[0].path.knots.push_back(1);
    CHECK(fault(face) == Error::knots_not_increasing);
  }
  SUBCASE("coordinates of different sizes") {
    face.surface.z.conservativeResize(face.surface.z.rows(), face.surface.z.cols() - 1);
    CHECK(fault(face) == Error::too_few_points);
  }
  SUBCASE("a hole without curves") {
    face.holes.push_back({});
    CHECK(fault(face) == Error::too_few_points);
  }
  SUBCASE("a loop that does not close") {
    face.outer[1].path.control.back().x() += 1e-8;
    CHECK(fault(face) == Error::open_loop);
  }
  SUBCASE("a loop that leaves the surface") {
    face.outer[0].path.control[1].y() -= 0.7;
    CHECK(fault(face) == Error::outside_domain);
  }
  SUBCASE("an outer loop that runs clockwise") {
    face.holes.clear();
    std::ranges::reverse(face.outer);
    for (auto& curve : face.outer) curve.reversed = !curve.reversed;
    CHECK(fault(face) == Error::wrong_way_round);
  }
  SUBCASE("a hole that runs counter-clockwise") {
    face.holes[0][0].reversed = true;
    CHECK(fault(face) == Error::wrong_way_round);
  }
  SUBCASE("a hole beside the face") {
    face.holes = {{{.path = test::ellipse({0.9, 0.85}, 0.05, 0.05, true)}}};
    CHECK(fault(face) == Error::wrong_way_round);
  }
  SUBCASE("a loop that crosses itself") {
    face.holes = {};
    face.outer[0].path.control[1].y() += 1.2;
    CHECK(fault(face) == Error::self_crossing);
  }
  SUBCASE("a hole that crosses the outer loop") {
    face.holes = {{{.path = test::ellipse({0.45, 0.3}, 0.2, 0.2, true)}}};
    CHECK(fault(face) == Error::self_crossing);
  }
  SUBCASE("holes in each other") {
    face.holes.push_back({{.path = test::ellipse({0.45, 0.35}, 0.05, 0.05, true)}});
    CHECK(fault(face) == Error::self_crossing);
  }
  SUBCASE("an image off the surface") {
    face.outer[0].image = image_on(face.surface, face.outer[0].path, tolerance_mm);
    face.outer[0].image->control[1].z() += 1e-3;
    CHECK(fault(face) == Error::off_surface);
  }
  SUBCASE("an image over another parameter") {
    face.outer[0].image = image_on(face.surface, face.outer[0].path, tolerance_mm);
    for (double& k : face.outer[0].image->knots) k *= 2;
    CHECK(fault(face) == Error::off_surface);
  }
}
