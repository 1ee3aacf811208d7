#include "host_sim/base/plan_polygon.hpp"
#include "host_sim/plates/plate_shape.hpp"

#include <doctest/doctest.h>

#include <cmath>

using namespace moldloft::host_sim;

namespace {

std::shared_ptr<const Plate> plate_of(Shape shape, OutlineKind outline = OutlineKind::square) {
  PlateDescription d;
  d.shape = shape;
  d.corners = outline_corners(outline, {});
  return *make_plate(d);
}

}  // namespace

TEST_CASE("every shape's slope is the derivative of its height") {
  for (const auto name : shape_names()) {
    CAPTURE(name);
    const auto plate = plate_of(*shape_named(name));
    for (const auto& p : std::vector<Eigen::Vector2d>{{0, 0}, {31, -77}, {-140, 120}, {150, 150}}) {
      constexpr double h = 1e-4;
      const double dx = (plate->height(p.x() + h, p.y()) - plate->height(p.x() - h, p.y())) / (2 * h);
      const double dy = (plate->height(p.x(), p.y() + h) - plate->height(p.x(), p.y() - h)) / (2 * h);
      CHECK(plate->gradient(p.x(), p.y()).x() == doctest::Approx(dx).epsilon(1e-6));
      CHECK(plate->gradient(p.x(), p.y()).y() == doctest::Approx(dy).epsilon(1e-6));
    }
  }
}

TEST_CASE("shapes have the heights that their formulas give at known points") {
  CHECK(plate_of(Shape::saddle)->height(152.5, 0) == doctest::Approx(10));
  CHECK(plate_of(Shape::saddle)->height(0, 152.5) == doctest::Approx(-10));
  CHECK(plate_of(Shape::twist)->height(152.5, -152.5) == doctest::Approx(-10));
  CHECK(plate_of(Shape::cylinder)->height(100, 33) == doctest::Approx(std::sqrt(1e6 - 1e4) - 1000));
  CHECK(plate_of(Shape::wave)->height(76.25, 0) == doctest::Approx(10));
  const auto dome = plate_of(Shape::dome);
  CHECK(dome->height(0, 0) - dome->height(152.5, 152.5) == doctest::Approx(20));
}

TEST_CASE("outlines are counter-clockwise, centred, and have the sides asked for") {
  for (const auto name : outline_names()) {
    CAPTURE(name);
    const auto corners = outline_corners(*outline_named(name), {});
    CHECK(signed_area(corners) > 0);
    CHECK(is_convex(corners));
  }
  const auto sheared =
      outline_corners(OutlineKind::parallelogram, {.width_mm = 200, .depth_mm = 100, .shear_mm = -40});
  CHECK((sheared[1] - sheared[0]).norm() == doctest::Approx(200));
  CHECK((sheared[3] - sheared[0]).x() == doctest::Approx(-40));
  CHECK((sheared[3] - sheared[0]).y() == doctest::Approx(100));
}

TEST_CASE("a plate lies on the table by its lowest underside") {
  const auto plate = resting_on_table(plate_of(Shape::saddle), 500, 20, 0.7);
  const double lowest = plate.z_mm + plate.plate->bounds().z_min - plate.plate->thickness_mm();
  CHECK(lowest == doctest::Approx(0).epsilon(1e-9));
  CHECK(plate.plate->bounds().z_min == doctest::Approx(-10));
}

TEST_CASE("an impossible plate is refused in one line") {
  PlateDescription d;
  d.shape = Shape::cylinder;
  d.radius_mm = 100;
  CHECK(make_plate(d).error().what ==
        "plate 'cylinder': the outline reaches past 0.9 of the radius of curvature");
  d.shape = Shape::flat;
  std::swap(d.corners[1], d.corners[3]);
  CHECK_FALSE(make_plate(d).has_value());
  CHECK(shape_named("sadle").error().what.find("saddle") != std::string::npos);
}

TEST_CASE("the largest quadrilateral of a chamfered rectangle has its four longest corners") {
  const std::vector<Eigen::Vector2d> outline = {{0, 0}, {100, 0}, {100, 50}, {99, 51}, {0, 50}, {-0.1, 25}};
  const auto corners = largest_quadrilateral(outline);
  CHECK(corners[0] == Eigen::Vector2d{0, 0});
  CHECK(corners[1] == Eigen::Vector2d{100, 0});
  CHECK((corners[2] - Eigen::Vector2d{100, 50}).norm() < 1.5);
  CHECK(corners[3] == Eigen::Vector2d{0, 50});
}
