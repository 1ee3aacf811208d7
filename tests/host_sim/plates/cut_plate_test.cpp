// Rims that are not four-sided, against the areas that geometry gives them, and a plate with a hole, against rays.
#include "host_sim/plates/cut_plate.hpp"

#include "host_sim/optics/ray_cast.hpp"
#include "host_sim/plates/cut_outline.hpp"
#include "host_sim/plates/plate_shape.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <numbers>

using namespace moldloft;
using namespace moldloft::host_sim;

namespace {

constexpr double side = 305, area = side * side;
const auto square = outline_corners(OutlineKind::square, {});

}  // namespace

TEST_CASE("each cut takes away the area that it should, and leaves a polygon that runs counter-clockwise") {
  CHECK(signed_area(notched(square, 2, 0.4, 60, 25)) == doctest::Approx(area - 60 * 25));
  CHECK(signed_area(stepped(square, 1, 40)) == doctest::Approx(area - 40 * side / 2));
  CHECK(signed_area(corner_cut(square, 3, 50)) == doctest::Approx(area - 50 * 50 / 2));
  // An arc in chords of 5 degrees lies within 0.1 % of the circle's area.
  CHECK(signed_area(rounded(square, 40)) == doctest::Approx(area - (4 - std::numbers::pi) * 1600).epsilon(2e-4));
  // |sin| is 2 / pi in the mean.
  CHECK(signed_area(scalloped(square, 61, 10)) ==
        doctest::Approx(area - 4 * side * 10 * 2 / std::numbers::pi).epsilon(2e-3));
  CHECK(signed_area(regular(3, 150)) == doctest::Approx(3 * std::sqrt(3.0) / 4 * 150 * 150));
  Random random{4, Stream::hard};
  const auto teeth = ragged(square, 10, 8, random);
  CHECK(signed_area(teeth) < area - 4 * side * 8 * 0.2 / 2);
  CHECK(signed_area(teeth) > area - 4 * side * 8 / 2);
  for (const auto& p : teeth) CHECK(distance_to_outline(square, p) <= 8.0001);
}

TEST_CASE("a step goes along half of one side, and its other sides stay where they are") {
  const auto out = stepped(square, 0, 30);
  REQUIRE(out.size() == 6);
  double lowest_left = 1e9, lowest_right = 1e9;
  for (const auto& p : out) {
    double& lowest = p.x() < 0 ? lowest_left : lowest_right;
    lowest = std::min(lowest, p.y());
  }
  CHECK(lowest_left == doctest::Approx(-side / 2));
  CHECK(lowest_right == doctest::Approx(-side / 2));  // where the step begins, at 0
  CHECK(contains(out, -100, -side / 2 + 15));
  CHECK_FALSE(contains(out, 100, -side / 2 + 15));
}

TEST_CASE("through a hole one sees the table, at its border the wall, beside it the plate") {
  Outline hole = regular(36, 20);
  for (auto& p : hole) p += Eigen::Vector2d{50, -30};
  const auto plate = make_cut_plate("holed", make_plate({.shape = Shape::flat}).value(),
                                    Outline{square.begin(), square.end()}, {hole});
  CHECK(plate->inside(0, 0));
  CHECK_FALSE(plate->inside(50, -30));
  CHECK(plate->inside(50, -9));  // 21 mm from the hole's middle
  CHECK_FALSE(plate->inside(50, -11));
  RayCast cast;
  cast.look_at(resting_on_table(plate, 0, 0, 0));
  const auto hit = [&](const Eigen::Vector3d& at, const Eigen::Vector3d& direction) {
    return cast.first_hit({at - 400 * direction, direction}, cast.all_edges(), 400).target;
  };
  const Eigen::Vector3d down{0, 0, -1};
  CHECK(hit({0, 0, 0}, down) == Target::top);
  CHECK(hit({50, -30, 0}, down) == Target::table);
  CHECK(hit({50, -8, 0}, down) == Target::top);
  // Into the far wall, 2 mm under the plate's top: 6 mm thick.
  CHECK(hit({69.9, -30, -2}, Eigen::Vector3d{0.5, 0, -1}.normalized()) == Target::wall);
  CHECK(hit({200, 0, 0}, down) == Target::table);
}

TEST_CASE("a plate that is cut keeps the surface of the one it was cut from") {
  const auto base = make_plate({.shape = Shape::saddle}).value();
  const auto plate = make_cut_plate("notched", base, notched(square, 0, 0.5, 60, 25));
  CHECK(plate->height(40, -70) == base->height(40, -70));
  CHECK(plate->inside(0, -side / 2 + 26));
  CHECK_FALSE(plate->inside(0, -side / 2 + 24));
  CHECK(plate->thickness_mm() == base->thickness_mm());
  for (const auto& c : plate->corners()) CHECK(std::abs(c.x()) == doctest::Approx(side / 2));
}
