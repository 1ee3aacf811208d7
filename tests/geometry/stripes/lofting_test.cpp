#include "geometry/stripes/lofting.hpp"

#include "geometry/splines/derived_curves.hpp"
#include "geometry/splines/refinement.hpp"
#include "geometry/splines/spline_samples.hpp"

#include <Eigen/SVD>
#include <doctest/doctest.h>

using namespace moldloft::geometry;
using samples::eps, samples::Numbers;

namespace {

double condition(const std::vector<double>& knots, int degree, const std::vector<double>& parameters) {
  Eigen::MatrixXd a(static_cast<Eigen::Index>(parameters.size()),
                    static_cast<Eigen::Index>(knots.size()) - degree - 1);
  for (Eigen::Index i = 0; i < a.rows(); ++i)
    for (int j = 0; j < a.cols(); ++j)
      a(i, j) = static_cast<double>(samples::basis(knots, j, degree, parameters[i]));
  const Eigen::JacobiSVD<Eigen::MatrixXd> svd(a);
  return svd.singularValues()(0) / svd.singularValues()(a.cols() - 1);
}

std::vector<SpaceCurve> lines_of(const BSplineSurface& surface, const std::vector<double>& u) {
  std::vector<SpaceCurve> lines;
  for (const double t : u) lines.push_back(line_along_v(surface, t));
  return lines;
}

// A plate 300 mm long in u, on which u runs at unit speed along both edges, so that chord lengths are right.
BSplineSurface even_plate(Numbers& numbers, int degree_u, int interior_u) {
  BSplineSurface s = numbers.surface(degree_u, interior_u, 3, 4);
  for (int i = 0; i < s.control_u(); ++i) {
    for (int j = 0; j < s.control_v(); ++j) {
      s.x(i, j) = 300 * greville(s.knots_u, i, degree_u), s.y(i, j) = 200 * greville(s.knots_v, j);
      s.z(i, j) = j == 0 || j + 1 == s.control_v() ? 0 : 20 * s.z(i, j);
    }
  }
  return s;
}

}  // namespace

TEST_CASE("an interpolating loft passes through its curves") {
  Numbers numbers;
  for (int degree : {1, 2, 3}) {
    std::vector<SpaceCurve> curves;
    for (int k = 0; k < 7; ++k) {
      auto curve = numbers.curve<3>(3, 0, 1);
      for (auto& p : curve.control) p.x() += 10 * k + numbers.in(-2, 2);
      curves.push_back(curve);
    }
    const auto lofted = loft(curves, {.degree = degree});
    REQUIRE(lofted.has_value());
    CHECK(check(lofted->surface).has_value());
    CHECK(lofted->surface.control_u() == 7);
    const double bound =
        4 * 7 * degree * eps * condition(lofted->surface.knots_u, degree, lofted->parameters) * 63;
    CHECK(lofted->max <= bound);
    for (int k = 0; k < 7; ++k) {
      const SpaceCurve line = line_along_v(lofted->surface, lofted->parameters[k]);
      for (double v = 0; v <= 1; v += 0.1)
        CHECK((line.value(v) - curves[k].value(v)).cwiseAbs().maxCoeff() <= 2 * bound);
    }
  }
}

TEST_CASE("a surface is given back by the loft through its lines, interpolated and approximated") {
  Numbers numbers;
  for (int degree : {1, 2, 3}) {
    // A polynomial in u: in the span of every knot vector that the loft may choose.
    const BSplineSurface plate = even_plate(numbers, degree, 0);
    const std::vector<double> u{0, 0.07, 0.2, 0.33, 0.5, 0.58, 0.7, 0.86, 0.93, 1};
    const auto curves = lines_of(plate, u);
    for (const int control_points : {0, degree + 1, degree + 3}) {
      const auto lofted = loft(curves, {.degree = degree, .control_points = control_points});
      REQUIRE(lofted.has_value());
      const double bound =
          4 * 10 * degree * eps * 300 * condition(lofted->surface.knots_u, degree, lofted->parameters);
      for (std::size_t k = 0; k < u.size(); ++k) CHECK(std::abs(lofted->parameters[k] - u[k]) <= 20 * eps);
      for (double a = 0; a <= 1; a += 0.11) {
        for (double b = 0; b <= 1; b += 0.2)
          CHECK((lofted->surface.at(a, b).value - plate.at(a, b).value).cwiseAbs().maxCoeff() <= 4 * bound);
      }
    }
  }
  // Any surface, with its own knots and parameters.
  const BSplineSurface plate = even_plate(numbers, 3, 4);
  const std::vector<double> u{0, 0.04, 0.1, 0.2, 0.25, 0.37, 0.45, 0.5, 0.61, 0.7, 0.8, 0.85, 0.9, 0.97, 1};
  const auto curves = lines_of(plate, u);
  for (const bool ends : {false, true}) {
    const auto lofted = loft(curves, u, plate.knots_u, {.interpolate_ends = ends});
    REQUIRE(lofted.has_value());
    const double bound = 4 * 15 * 3 * eps * 300 * condition(plate.knots_u, 3, u);
    CHECK((lofted->surface.z - plate.z).cwiseAbs().maxCoeff() <= bound);
    CHECK((lofted->surface.x - plate.x).cwiseAbs().maxCoeff() <= bound);
    CHECK(lofted->max <= bound);
  }
}

TEST_CASE("an approximating loft is smoother than an interpolating one where curves are noisy") {
  Numbers numbers;
  const BSplineSurface plate = even_plate(numbers, 3, 0);
  std::vector<double> u;
  for (int k = 0; k < 40; ++k) u.push_back(k / 39.0);
  auto curves = lines_of(plate, u);
  std::normal_distribution<double> noise(0, 0.1);
  for (auto& curve : curves)
    for (auto& p : curve.control) p.z() += noise(numbers.random);
  const auto through = loft(curves), near = loft(curves, {.control_points = 6});
  REQUIRE(through.has_value());
  REQUIRE(near.has_value());
  const auto rms_of = [&](const BSplineSurface& surface) {
    double squares = 0;
    int count = 0;
    for (double a = 0.005; a < 1; a += 0.01)
      for (double b = 0.05; b < 1; b += 0.1, ++count)
        squares += std::pow(surface.at(a, b).value.z() - plate.at(a, b).value.z(), 2);
    return std::sqrt(squares / count);
  };
  // Fitting 6 unknowns to 40 values leaves sqrt(6 / 40) of the noise; interpolation leaves about all of it.
  CHECK(rms_of(near->surface) < 0.6 * rms_of(through->surface));
  CHECK(through->max < 1e-12);
  CHECK(near->rms == doctest::Approx(0.1 * std::sqrt(34.0 / 40)).epsilon(0.2));
  CHECK(near->pivots.ratio() > 0.05);
}

TEST_CASE("an approximating loft may keep its first and last curve") {
  Numbers numbers;
  std::vector<SpaceCurve> curves;
  for (int k = 0; k < 12; ++k) {
    auto curve = numbers.curve<3>(3, 0, 1);
    for (auto& p : curve.control) p.x() += 10 * k;
    curves.push_back(curve);
  }
  const auto lofted = loft(curves, {.control_points = 6, .interpolate_ends = true});
  REQUIRE(lofted.has_value());
  for (int j = 0; j < 4; ++j) {
    CHECK(lofted->surface.z(0, j) == curves.front().control[j].z());
    CHECK(lofted->surface.x(5, j) == curves.back().control[j].x());
  }
  // The rest is the least squares solution under that condition: no change of an inner row makes it better.
  const auto squares = [&](const BSplineSurface& s) {
    double sum = 0;
    for (std::size_t k = 0; k < curves.size(); ++k) {
      const SpaceCurve line = line_along_v(s, lofted->parameters[k]);
      for (int j = 0; j < 4; ++j) sum += (line.control[j] - curves[k].control[j]).squaredNorm();
    }
    return sum;
  };
  const double least = squares(lofted->surface);
  for (int i = 1; i < 5; ++i) {
    for (const double step : {-1e-3, 1e-3}) {
      BSplineSurface moved = lofted->surface;
      moved.z(i, 2) += step;
      CHECK(squares(moved) > least);
    }
  }
}

TEST_CASE("loft parameters are the means of both rows of end points") {
  const auto segment = [](double start, double end) {
    return SpaceCurve{uniform_clamped_knots(1, 1), {{start, 0, 0}, {end, 1, 0}}, 1};
  };
  const std::vector<SpaceCurve> curves{segment(0, 0), segment(1, 6), segment(4, 10)};
  const auto u = loft_parameters(curves);  // 0, 1/4, 1 and 0, 6/10, 1
  REQUIRE(u.has_value());
  CHECK((*u)[0] == 0);
  CHECK((*u)[1] == doctest::Approx((0.25 + 0.6) / 2).epsilon(1e-15));
  CHECK((*u)[2] == 1);
  // Curves that leave one point in common are led by their other ends.
  const std::vector<SpaceCurve> fan{segment(0, 0), segment(0, 3), segment(0, 4)};
  CHECK((*loft_parameters(fan))[1] == 0.75);
}

TEST_CASE("what is wrong with curves to be lofted is named, and which of them") {
  Numbers numbers;
  std::vector<SpaceCurve> curves;
  for (int k = 0; k < 6; ++k) {
    curves.push_back(numbers.curve<3>(3, 0, 1));
    for (auto& p : curves.back().control) p.x() += 10 * k;
  }
  const auto is = [](const auto& lofted, Error what, std::size_t where) {
    return !lofted.has_value() && lofted.error().error == what && lofted.error().where == where;
  };
  CHECK(loft(curves).has_value());
  CHECK(is(loft(std::span{curves}.first(3)), Error::too_few_points, 3));
  CHECK(is(loft(curves, {.control_points = 7}), Error::too_few_points, 6));
  auto wrong = curves;
  wrong[4] = refine(wrong[4], with_full_knot(wrong[4].knots, 1, 0.5));
  CHECK(is(loft(wrong), Error::curves_not_compatible, 4));
  wrong = curves, wrong[2].control[1].y() = std::nan("");
  CHECK(is(loft(wrong), Error::not_finite, 2));
  wrong = curves, wrong[3] = wrong[2];
  CHECK(is(loft(wrong), Error::coincident_curves, 3));
  CHECK(is(loft_parameters(wrong), Error::coincident_curves, 3));
  CHECK(is(loft_parameters(std::span{curves}.first(1)), Error::too_few_points, 1));
  const std::vector<double> crowded{0, 0.01, 0.02, 0.03, 0.04, 1};
  CHECK(is(loft(curves, crowded, uniform_clamped_knots(3)), Error::span_without_points, 4));
  CHECK(is(loft(curves, std::vector{0.0, 0.2, 0.4, 0.6, 0.8, 1.2}, uniform_clamped_knots(2)),
           Error::outside_domain, 5));
  CHECK(is(loft(curves, std::vector{0.0, 0.2, 0.4, 0.3, 0.8, 1.0}, uniform_clamped_knots(2)),
           Error::coincident_curves, 3));
}
