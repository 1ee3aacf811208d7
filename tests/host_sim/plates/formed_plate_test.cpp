// Plates that became something else than they were to become, by mistakes that are known.
#include "host_sim/plates/formed_plate.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <string>
#include <tuple>

using namespace moldloft::host_sim;

namespace {

std::shared_ptr<const Plate> wave() { return make_plate({.shape = Shape::wave}).value(); }
std::shared_ptr<const Plate> formed(const char* text) {
  return make_formed_plate(wave(), mistakes_from(text).value()).value();
}

}  // namespace

TEST_CASE("each mistake is where and as large as it says") {
  const auto plain = wave();
  const double x = 60, y = -35;
  CHECK(formed("springback 0.9")->height(x, y) == doctest::Approx(0.9 * plain->height(x, y)));
  const auto twisted = formed("twist 3 mm");
  const auto off = [&](double sx, double sy) {
    return twisted->height(sx * 152.5, sy * 152.5) - plain->height(sx * 152.5, sy * 152.5);
  };
  // One corner against the plane of the other three.
  CHECK(off(1, 1) - (off(1, -1) + off(-1, 1) - off(-1, -1)) == doctest::Approx(3));
  CHECK(formed("bow 2 mm")->height(152.5, 0) - plain->height(152.5, 0) == doctest::Approx(2));
  CHECK(formed("bow 2")->height(0, 80) == doctest::Approx(plain->height(0, 80)));
  const auto dented = formed("dent 5 mm at 100,80");
  CHECK(dented->height(100, 80) - plain->height(100, 80) == doctest::Approx(-5));
  CHECK(dented->height(100, 120) == doctest::Approx(plain->height(100, 120)));
  CHECK(formed("dent -2 mm at 0,0 radius 60")->height(0, 0) == doctest::Approx(plain->height(0, 0) + 2));
}

TEST_CASE(
    "a shift moves the shape within its outline, and what is said twice or beyond the shape is refused") {
  const auto shifted = formed("shift 12,-7 mm");
  CHECK(shifted->height(60, -35) == doctest::Approx(wave()->height(48, -28)));
  CHECK(shifted->corners()[2] == wave()->corners()[2]);
  for (const char* text : {"twist 1, twist 2", "wave, wave", "springback 0.9, bow 1, springback 0.9",
                           "shift 1,2, shift 1,2", "shift 3 mm", "shift 101,0", "shift nan,0"}) {
    CAPTURE(text);
    CHECK_FALSE(mistakes_from(text));
  }
  CHECK(mistakes_from("dent 1 at 0,0, dent 2 at 10,10")->dents.size() == 2);
  const auto steep = make_plate({.shape = Shape::cylinder, .radius_mm = 170}).value();
  CHECK(make_formed_plate(steep, mistakes_from("shift 10,0").value()));
  CHECK_FALSE(make_formed_plate(steep, mistakes_from("shift 30,0").value()));
}

TEST_CASE("mistakes are written down in the words that they are read from") {
  for (const char* text :
       {"dome, springback 0.1, twist -3.25 mm, bow 1e-3, shift 0.5,-2 mm, dent 5 at 100,80",
        "dent -2 mm at 0,-7.5 radius 60, dent 1 at 3,4", "flat"}) {
    const auto first = mistakes_from(text).value();
    const std::string words = words_of(first);
    const auto again = mistakes_from(words);
    REQUIRE_MESSAGE(again.has_value(), words);
    CHECK(words_of(*again) == words);
    CHECK(again->shape == first.shape);
    CHECK(
        std::tuple{again->springback, again->twist_mm, again->bow_mm, again->shift_x_mm, again->shift_y_mm} ==
        std::tuple{first.springback, first.twist_mm, first.bow_mm, first.shift_x_mm, first.shift_y_mm});
    REQUIRE(again->dents.size() == first.dents.size());
    for (std::size_t i = 0; i < first.dents.size(); ++i)
      CHECK(std::tuple{again->dents[i].depth_mm, again->dents[i].x_mm, again->dents[i].radius_mm} ==
            std::tuple{first.dents[i].depth_mm, first.dents[i].x_mm, first.dents[i].radius_mm});
  }
  CHECK(words_of(Mistakes{}).empty());
}

TEST_CASE("the difference of heights is the mistake's") {
  const auto twist = height_difference(*formed("twist 4 mm"), *wave());
  CHECK(twist.highest_mm == doctest::Approx(1));
  CHECK(twist.lowest_mm == doctest::Approx(-1));
  CHECK(twist.rms_mm == doctest::Approx(1.0 / 3).epsilon(0.02));  // of p q over the square
  CHECK(height_difference(*wave(), *wave()).rms_mm == 0);
}

TEST_CASE("slopes are those of the heights") {
  const auto plate =
      formed("springback 0.8, twist 4 mm, bow -1 mm, dent 3 mm at 20,30 radius 50, dent -1 at -50,0");
  for (const auto& [x, y] : {std::pair{25.0, 10.0}, {-60.0, 12.0}, {100.0, -120.0}}) {
    const double h = 1e-4;
    const auto s = plate->sample(x, y);
    CHECK(s.slope_x ==
          doctest::Approx((plate->height(x + h, y) - plate->height(x - h, y)) / (2 * h)).epsilon(1e-5));
    CHECK(s.slope_y ==
          doctest::Approx((plate->height(x, y + h) - plate->height(x, y - h)) / (2 * h)).epsilon(1e-5));
  }
}

TEST_CASE("a plate as a spline is the plate, on every outline") {
  for (const auto outline : {OutlineKind::square, OutlineKind::trapezoid, OutlineKind::parallelogram}) {
    for (const auto shape :
         {Shape::wave, Shape::dome, Shape::cylinder, Shape::saddle, Shape::twist, Shape::flat}) {
      const auto plate = make_plate({.shape = shape, .corners = outline_corners(outline, {})}).value();
      const auto spline = spline_of(*plate);
      double most = 0;
      for (int i = 0; i <= 37; ++i) {
        for (int k = 0; k <= 37; ++k) {
          const Eigen::Vector3d p = spline.at(i / 37.0, k / 37.0).value;
          most = std::max(most, std::abs(p.z() - plate->height(p.x(), p.y())));
        }
      }
      CHECK(most < 1e-4);
      CHECK((spline.at(1, 1).value.head<2>() - plate->corners()[2]).norm() < 1e-9);
    }
  }
}

TEST_CASE("what cannot be formed is refused in one line") {
  for (const char* text : {"", "  ", "foo", "springback", "springback -1", "springback 4", "springback nan",
                           "twist 3 mm,, bow 1", "dent 5", "dent 5 mm at 1", "dent 5 at 1,2 radius 0",
                           "bow 501", "twist 3 mm extra", "bow 1, wave"}) {
    CAPTURE(text);
    const auto found = mistakes_from(text);
    REQUIRE_FALSE(found);
    CHECK(found.error().what.find('\n') == std::string::npos);
  }
  CHECK_FALSE(make_formed_plate(wave(), mistakes_from("dent 5 mm at 200,0").value()));
}
