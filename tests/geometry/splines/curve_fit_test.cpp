#include "geometry/splines/curve_fit.hpp"

#include "geometry/splines/spline_samples.hpp"

#include <Eigen/QR>
#include <Eigen/SVD>
#include <doctest/doctest.h>

using namespace moldloft::geometry;
using samples::eps, samples::Numbers;

namespace {

std::vector<double> evenly(int count) {
  std::vector<double> t(static_cast<std::size_t>(count));
  for (int i = 0; i < count; ++i) t[i] = static_cast<double>(i) / (count - 1);
  return t;
}

template <int dim>
std::vector<Eigen::Matrix<double, dim, 1>> points_on(const BSplineCurve<dim>& curve,
                                                     const std::vector<double>& parameters) {
  std::vector<Eigen::Matrix<double, dim, 1>> points;
  for (const double t : parameters) points.push_back(curve.value(t));
  return points;
}

Eigen::MatrixXd collocation(const std::vector<double>& knots, int degree,
                            const std::vector<double>& parameters) {
  const auto n = static_cast<Eigen::Index>(knots.size()) - degree - 1;
  Eigen::MatrixXd a(static_cast<Eigen::Index>(parameters.size()), n);
  for (Eigen::Index i = 0; i < a.rows(); ++i)
    for (int j = 0; j < n; ++j)
      a(i, j) = static_cast<double>(samples::basis(knots, j, degree, parameters[i]));
  return a;
}

double condition(const Eigen::MatrixXd& a) {
  const Eigen::JacobiSVD<Eigen::MatrixXd> svd(a);
  return svd.singularValues()(0) / svd.singularValues()(a.cols() - 1);
}

// A wavy stripe across a plate, mm, with noise of size `sigma` in all directions.
std::vector<Eigen::Vector3d> stripe(int count, double sigma, Numbers& numbers) {
  std::normal_distribution<double> noise(0, sigma > 0 ? sigma : 1);
  std::vector<Eigen::Vector3d> points;
  for (const double t : evenly(count)) {
    points.emplace_back(300 * t, 20 + 5 * t, 15 * std::sin(5 * t) + 3 * std::cos(17 * t));
    if (sigma > 0) points.back() += Eigen::Vector3d::NullaryExpr([&] { return noise(numbers.random); });
  }
  return points;
}

}  // namespace

TEST_CASE("a spline is given back by the fit over its own knots, at any degree") {
  Numbers numbers;
  for (int p : {1, 2, 3, 5}) {
    const auto truth = numbers.curve<3>(p, 5);
    const auto parameters = evenly(60);
    const auto points = points_on(truth, parameters);
    for (const bool ends : {false, true}) {
      const auto fit = fit_curve<3>(points, parameters, truth.knots, {.degree = p, .interpolate_ends = ends});
      REQUIRE(fit.has_value());
      const double bound = 4 * 60 * p * eps * condition(collocation(truth.knots, p, parameters));
      for (std::size_t i = 0; i < truth.control.size(); ++i)
        CHECK((fit->curve.control[i] - truth.control[i]).cwiseAbs().maxCoeff() <= bound);
      CHECK(fit->max <= bound);
      CHECK(fit->pivots.ratio() > 0.01);
      if (ends) CHECK(fit->curve.control.front() == points.front());
      if (ends) CHECK(fit->curve.control.back() == points.back());
    }
  }
}

TEST_CASE("a polynomial is reproduced whatever the knots are") {
  Numbers numbers;
  const auto knots = numbers.knots(3, 6);
  std::vector<double> parameters = evenly(50);
  std::vector<Eigen::Vector2d> points;
  for (const double t : parameters) points.emplace_back(1 + t * (2 - t * (3 - t)), t * t * t);
  const auto fit = fit_curve<2>(points, parameters, knots);
  REQUIRE(fit.has_value());
  const double bound = 3 * 4 * 50 * 3 * eps * condition(collocation(knots, 3, parameters));
  for (double t = 0; t <= 1; t += 0.03) {
    CHECK(
        (fit->curve.value(t) - Eigen::Vector2d(1 + t * (2 - t * (3 - t)), t * t * t)).cwiseAbs().maxCoeff() <=
        bound);
  }
}

TEST_CASE("a noisy stripe is fitted as the dense solution fits it, with its residuals told") {
  Numbers numbers;
  const auto points = stripe(120, 0.05, numbers);
  const auto knots = uniform_clamped_knots(9);
  const auto fit = fit_curve<3>(points, knots);
  REQUIRE(fit.has_value());
  const auto parameters = chord_length_parameters<3>(points);
  REQUIRE(parameters.has_value());
  CHECK(fit->parameters == *parameters);
  const Eigen::MatrixXd a = collocation(knots, 3, *parameters);
  Eigen::MatrixXd b(120, 3);
  for (int i = 0; i < 120; ++i) b.row(i) = points[i].transpose();
  const Eigen::MatrixXd dense = a.colPivHouseholderQr().solve(b), residual = a * dense - b;
  for (Eigen::Index i = 0; i < dense.rows(); ++i)
    CHECK((fit->curve.control[i] - dense.row(i).transpose()).norm() <=
          4 * 120 * 3 * eps * condition(a) * 310);
  CHECK(fit->rms == doctest::Approx(std::sqrt(residual.squaredNorm() / 120)).epsilon(1e-9));
  Eigen::Index farthest;
  CHECK(fit->max == doctest::Approx(residual.rowwise().norm().maxCoeff(&farthest)).epsilon(1e-9));
  CHECK(fit->farthest == farthest);
  CHECK(fit->pivots.ratio() >= 1 / condition(a) * (1 - 1e-9));
}

TEST_CASE("a fit moves with its points") {
  Numbers numbers;
  auto points = stripe(80, 0.1, numbers);
  const auto parameters = evenly(80);
  const auto before = fit_curve<3>(points, parameters, uniform_clamped_knots(5));
  const Eigen::Matrix3d turn =
      Eigen::AngleAxisd(0.7, Eigen::Vector3d(1, 2, 3).normalized()).toRotationMatrix();
  const Eigen::Vector3d shift(100, -50, 20);
  for (auto& p : points) p = turn * p + shift;
  const auto after = fit_curve<3>(points, parameters, uniform_clamped_knots(5));
  for (std::size_t i = 0; i < before->curve.control.size(); ++i)
    CHECK((after->curve.control[i] - (turn * before->curve.control[i] + shift)).norm() < 1e-9);
  CHECK(after->rms == doctest::Approx(before->rms).epsilon(1e-9));
}

TEST_CASE("chord lengths of a bent line are the shares of its length") {
  const std::vector<Eigen::Vector2d> points{{0, 0}, {3, 4}, {3, 14}, {8, 14}};
  CHECK(*chord_length_parameters<2>(points) == std::vector{0.0, 0.25, 0.75, 1.0});
}

TEST_CASE("the fewest control points that meet a tolerance are found") {
  Numbers numbers;
  const auto points = stripe(81, 0, numbers);
  const auto parameters = *chord_length_parameters<3>(points);
  for (const double tolerance : {1.0, 0.05, 0.001}) {
    const auto fit = fit_curve_within<3>(points, parameters, tolerance);
    REQUIRE(fit.has_value());
    CHECK(fit->max <= tolerance);
    for (int n = 4; n < static_cast<int>(fit->curve.control.size()); ++n)
      CHECK(fit_curve<3>(points, parameters, balanced_knots(parameters, n))->max > tolerance);
  }
  // A straight stripe needs no interior knot, and an exact one is reached by interpolation at the latest.
  std::vector<Eigen::Vector2d> line;
  for (int i = 0; i < 20; ++i) line.emplace_back(i, 2 * i);
  CHECK(fit_curve_within<2>(line, evenly(20), 1e-9)->curve.control.size() == 4);
  const auto jagged = stripe(12, 5, numbers);
  CHECK(fit_curve_within<3>(jagged, evenly(12), 1e-9)->curve.control.size() == 12);
}

TEST_CASE("cross-validation spends control points on shape and not on noise") {
  Numbers numbers;
  const double sigma = 0.05;
  const auto points = stripe(200, sigma, numbers), truth = stripe(200, 0, numbers);
  const auto parameters = evenly(200);
  const auto error_of = [&](const BSplineCurve<3>& curve) {
    double squares = 0;
    for (int i = 0; i < 200; ++i) squares += (curve.value(parameters[i]) - truth[i]).squaredNorm();
    return std::sqrt(squares / 200);
  };
  const auto chosen = fit_curve_by_cross_validation<3>(points, parameters);
  REQUIRE(chosen.has_value());
  double best = 1e9;
  for (int n = 4; n <= 100; ++n)
    best = std::min(best, error_of(fit_curve<3>(points, parameters, balanced_knots(parameters, n))->curve));
  CHECK(error_of(chosen->curve) <=
        1.3 * best);  // the score's spread at 200 points; half or double the net is beyond
  const auto n = static_cast<double>(chosen->curve.control.size());
  CHECK(chosen->rms / std::sqrt(3 * (1 - n / 200)) ==
        doctest::Approx(sigma).epsilon(0.1));  // sigma +- 3 / sqrt(1200)
}

TEST_CASE("what is wrong with a stripe is named, and where") {
  const double nan = std::nan("");
  const auto knots = uniform_clamped_knots(3);
  std::vector<Eigen::Vector2d> points;
  for (int i = 0; i < 20; ++i) points.emplace_back(i, i * i);
  const auto good = evenly(20);
  const auto error = [&](const std::vector<Eigen::Vector2d>& p, const std::vector<double>& t,
                         const std::vector<double>& k) {
    const auto fit = fit_curve<2>(p, t, k);
    return fit ? std::pair{std::string{"none"}, 0}
               : std::pair{std::string{to_string(fit.error().error)}, static_cast<int>(fit.error().where)};
  };
  const auto is = [](Error what, int where) { return std::pair{std::string{to_string(what)}, where}; };
  CHECK(error(points, good, knots).first == "none");

  auto bad = points;
  bad[7].y() = nan;
  CHECK(error(bad, good, knots) == is(Error::not_finite, 7));
  CHECK(chord_length_parameters<2>(bad).error().where == 7);
  bad = points;
  bad[5] = bad[4];
  CHECK(chord_length_parameters<2>(bad).error().error == Error::repeated_points);
  CHECK(chord_length_parameters<2>(bad).error().where == 5);
  CHECK(fit_curve<2>(bad, knots).error().error == Error::repeated_points);
  CHECK(chord_length_parameters<2>(Points<2>{points}.first(1)).error().error == Error::too_few_points);

  auto t = good;
  t[3] = 0;
  CHECK(error(points, t, knots) == is(Error::repeated_points, 3));
  t = good, t[19] = 1.5;
  CHECK(error(points, t, knots) == is(Error::outside_domain, 19));
  t = good, t[2] = nan;
  CHECK(error(points, t, knots) == is(Error::not_finite, 2));

  CHECK(error({points.begin(), points.begin() + 5}, evenly(5), knots) == is(Error::too_few_points, 5));
  CHECK(error(points, good, {0, 0, 0, 0, 0.7, 0.5, 1, 1, 1, 1}) == is(Error::knots_not_increasing, 0));
  CHECK(error(points, good, {0, 0, 0, 1, 1, 1}) == is(Error::knots_wrong_count, 0));
  CHECK(fit_curve_within<2>(points, std::vector<double>(20, 0.5), 1).error().error == Error::repeated_points);
  CHECK(fit_curve_within<2>(Points<2>{points}.first(3), evenly(3), 1).error().error == Error::too_few_points);
  const auto far = fit_curve_within<2>(points, good, -1).error();
  CHECK(far.error == Error::tolerance_not_met);
  REQUIRE(far.where >= 4);
  const auto closest = fit_curve<2>(points, good, balanced_knots(good, static_cast<int>(far.where), 3));
  CHECK(closest->max < 1e-9);
}

TEST_CASE("a control point that no parameter decides is named by Schoenberg and Whitney") {
  std::vector<Eigen::Vector2d> points;
  std::vector<double> parameters;
  for (int i = 0; i < 30; ++i) {  // none in (0.3, 0.9)
    parameters.push_back(i < 20 ? 0.015 * i : 0.9 + 0.01 * (i - 20));
    points.emplace_back(parameters.back(), 1);
  }
  const std::vector<double> knots{0, 0, 0, 0, 0.1, 0.3, 0.4, 0.5, 0.6, 0.7, 0.9, 1, 1, 1, 1};
  const auto fit = fit_curve<2>(points, parameters, knots);
  REQUIRE(!fit.has_value());
  CHECK(fit.error().error == Error::span_without_points);
  CHECK(fit.error().where == 5);  // lives on (0.3, 0.7)
  // The dense matrix says the same in numbers.
  CHECK(condition(collocation(knots, 3, parameters)) > 1e15);
  // Points in the gap bring it to life; two of them in one place are one, and then the next
  // control point starves.
  const std::vector<double> enough{0.0, 0.05, 0.2, 0.25, 0.28, 0.35, 0.45, 0.55, 0.92, 0.95, 1.0};
  CHECK(first_without_parameter(knots, 3, enough, 0, 11) == 11);
  CHECK(condition(collocation(knots, 3, enough)) < 1e6);
  const std::vector<double> doubled{0.0, 0.05, 0.05, 0.2, 0.25, 0.35, 0.35, 0.45, 0.95, 0.97, 1.0};
  CHECK(first_without_parameter(knots, 3, doubled, 0, 11) == 6);
  CHECK(condition(collocation(knots, 3, doubled)) > 1e15);
}

TEST_CASE("a control point that only the rim of its span decides is singular") {
  const std::vector<double> knots{0, 0, 0, 0, 0.5, 1, 1, 1, 1};
  // The last two basis functions see only parameters where they are as small as rounding.
  const std::vector<double> parameters{0, 0.1, 0.2, 0.3, 0.5 + 1e-7, 0.5 + 2e-7};
  const std::vector<Eigen::Vector2d> points(6, Eigen::Vector2d(1, 2));
  const auto fit = fit_curve<2>(points, parameters, knots);
  REQUIRE(!fit.has_value());
  CHECK(fit.error().error == Error::singular);
  CHECK(fit.error().where == 4);
}
