#include "geometry/splines/knots.hpp"

#include "geometry/splines/spline_samples.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <limits>

using namespace moldloft::geometry;
using samples::Numbers;

TEST_CASE("uniform clamped knots of any degree") {
  CHECK(uniform_clamped_knots(2, 1) == std::vector{0.0, 0.0, 0.5, 1.0, 1.0});
  CHECK(uniform_clamped_knots(1, 2) == std::vector{0.0, 0.0, 0.0, 1.0, 1.0, 1.0});
  CHECK(uniform_clamped_knots(4).size() == 11);
}

TEST_CASE("what is wrong with knots from outside is named") {
  const double nan = std::nan("");
  const auto wrong = [](std::vector<double> knots, int degree, int control) {
    const auto checked = check_knots(knots, degree, control);
    return checked ? "nothing" : to_string(checked.error());
  };
  CHECK(wrong({0, 0, 0, 0, 0.5, 1, 1, 1, 1}, 3, 5) == "nothing");
  CHECK(wrong({0, 0, 0, 0, 0.5, 0.5, 0.5, 1, 1, 1, 1}, 3, 7) == "nothing");
  CHECK(wrong({0, 0, 1, 1}, 1, 2) == "nothing");
  CHECK(wrong({0, 1, 2}, 0, 2) == "nothing");
  CHECK(wrong({0, 0, 0, 0, 0.5, 1, 1, 1, 1}, 3, 6) == to_string(Error::knots_wrong_count));
  CHECK(wrong({0, 0, 0, 1, 1, 1}, 3, 2) == to_string(Error::knots_wrong_count));
  CHECK(wrong({0, 0, 0, 0, nan, 1, 1, 1, 1}, 3, 5) == to_string(Error::not_finite));
  CHECK(wrong({0, 0, 0, 0, 0.7, 0.5, 1, 1, 1, 1}, 3, 6) == to_string(Error::knots_not_increasing));
  CHECK(wrong({0, 0, 0, 0.1, 0.5, 1, 1, 1, 1}, 3, 5) == to_string(Error::knots_not_clamped));
  CHECK(wrong({0, 0, 0, 0, 0.5, 0.9, 1, 1, 1}, 3, 5) == to_string(Error::knots_not_clamped));
  CHECK(wrong({2, 2, 2, 2, 2, 2, 2, 2}, 3, 4) == to_string(Error::knots_not_clamped));
  CHECK(wrong({0, 0, 0, 0, 0.5, 0.5, 0.5, 0.5, 1, 1, 1, 1}, 3, 8) == to_string(Error::knot_too_often));
  CHECK(wrong({0, 0, 0, 0, 0, 1, 1, 1, 1}, 3, 5) == to_string(Error::knot_too_often));
  CHECK(wrong({0, 0, 0, 0, 1, 1, 1, 1, 1}, 3, 5) == to_string(Error::knot_too_often));
}

TEST_CASE("the span of a parameter is found wherever knots are uneven") {
  Numbers numbers;
  for (int degree : {0, 1, 2, 3, 5}) {
    for (int trial = 0; trial < 20; ++trial) {
      const auto knots = numbers.knots(degree, numbers.of(0, 12));
      const int last = static_cast<int>(knots.size()) - degree - 2;
      std::vector<double> places = knots;
      for (int i = 0; i < 50; ++i) places.push_back(numbers.in(-0.1, 1.1));
      for (const double t : places) {
        int expected = degree;  // the last filled span that does not begin above t
        for (int k = degree; k <= last; ++k)
          if (knots[k] < knots[k + 1] && knots[k] <= t) expected = k;
        CHECK(find_span(knots, t, degree) == expected);
      }
    }
  }
}

TEST_CASE("filled spans and multiplicities are counted") {
  const std::vector<double> knots{0, 0, 0, 0, 0.1, 0.35, 0.35, 0.8, 1, 1, 1, 1};
  CHECK(filled_spans(knots) == std::vector{3, 4, 6, 7});
  CHECK(multiplicity(knots, 0.35) == 2);
  CHECK(multiplicity(knots, 0) == 4);
  CHECK(multiplicity(knots, 0.5) == 0);
  CHECK(greville(knots, 1, 2) == 0.0);
  CHECK(greville(knots, 2, 2) == 0.05);
  CHECK(greville(knots, 3, 1) == 0.1);
}

TEST_CASE("merged knots hold every knot of both as often as the one that has it most, in either order") {
  const std::vector<double> a{0, 0, 0.2, 0.5, 0.5, 1, 1}, b{0, 0, 0.3, 0.5, 1, 1};
  CHECK(merge_knots(a, b) == std::vector{0.0, 0.0, 0.2, 0.3, 0.5, 0.5, 1.0, 1.0});
  CHECK(merge_knots(b, a) == merge_knots(a, b));
  CHECK(merge_knots(a, a) == a);
  Numbers numbers;
  for (int trial = 0; trial < 50; ++trial) {
    const auto one = numbers.knots(3, 6), other = numbers.knots(3, 4), third = numbers.knots(3, 2);
    for (const double tolerance : {0.0, 0.05}) {
      CHECK(merge_knots(one, other, tolerance) == merge_knots(other, one, tolerance));
      const std::vector all{one, other, third}, back{third, other, one};
      CHECK(merge_knots(all, tolerance) == merge_knots(back, tolerance));
    }
    const auto merged = merge_knots(one, other);
    for (const auto& knots : {one, other})
      for (const double t : knots) CHECK(multiplicity(merged, t) >= multiplicity(knots, t));
    for (const double t : merged)
      CHECK(multiplicity(merged, t) == std::max(multiplicity(one, t), multiplicity(other, t)));
  }
}

TEST_CASE("knots within the tolerance count as one") {
  const std::vector<double> a{0, 0, 0.5, 1, 1}, b{0, 0, 0.5 + 1e-9, 1, 1};
  CHECK(merge_knots(a, b, 1e-8) == a);
  CHECK(merge_knots(a, b, 1e-10).size() == 6);
  CHECK(snap_knots(b, a, 1e-8) == a);
  CHECK(snap_knots(b, a, 1e-10) == b);
  // A chain does not swallow what is farther than the tolerance from its first knot.
  CHECK(merge_knots({0, 0.4, 1}, {0, 0.45, 0.52, 1}, 0.1) == std::vector{0.0, 0.4, 0.52, 1.0});
}

TEST_CASE("averaged and balanced knots leave every span its parameters") {
  const std::vector<double> parameters{0, 0.1, 0.2, 0.7, 0.8, 1};
  const auto averaged = averaged_knots(parameters);
  REQUIRE(averaged.size() == 10);
  CHECK(averaged[4] == doctest::Approx(1.0 / 3));
  CHECK(averaged[5] == doctest::Approx(1.7 / 3));
  CHECK(balanced_knots(parameters, 6) == averaged);
  Numbers numbers;
  for (int trial = 0; trial < 30; ++trial) {
    std::vector<double> many(40);
    for (double& t : many) t = numbers.in(0, 1);
    std::ranges::sort(many);
    for (int control = 4; control <= 40; ++control) {
      const auto knots = balanced_knots(many, control);
      CHECK(check_knots(knots, 3, control).has_value());
      for (int i = 0; i < control; ++i) {  // Schoenberg and Whitney, in the stricter form of The NURBS Book
        const auto inside = std::ranges::count_if(many, [&](double t) {
          return (knots[i] < t && t < knots[i + 4]) || (i == 0 && t == knots[0]) ||
                 (i == control - 1 && t == knots.back());
        });
        CHECK(inside >= 1);
      }
    }
  }
}

TEST_CASE("cubic knots that decide the number of control points themselves are refused by name") {
  const auto refused = [](std::vector<double> knots) { return check_cubic_knots(knots).error(); };
  CHECK(refused({0, 0, 0, 0, 0.6, 0.5, 1, 1, 1, 1}) == Error::knots_not_increasing);
  CHECK(refused({0, 0, 0, 0, 0.5, 0.5, 0.5, 0.5, 1, 1, 1, 1}) == Error::knot_too_often);
  CHECK(refused({0, 0, 0, 0, std::nan(""), 1, 1, 1, 1}) == Error::not_finite);
  CHECK(refused({0, 0, 0, 1, 1, 1}) == Error::knots_wrong_count);
  CHECK(check_cubic_knots(std::vector<double>{0, 0, 0, 0, 0.5, 0.5, 0.5, 1, 1, 1, 1}).has_value());
}
