#include "geometry/stripes/bezier_surface_fit.hpp"

#include "bench/literal_matching.hpp"
#include "geometry/splines/bernstein_form.hpp"

#include <Eigen/LU>
#include <Eigen/SVD>
#include <doctest/doctest.h>

#include <cmath>
#include <limits>
#include <random>

using namespace moldloft;
using namespace moldloft::geometry;
using Eigen::MatrixX3d, Eigen::MatrixXd, Eigen::Vector2d;

namespace {

constexpr double eps = std::numeric_limits<double>::epsilon();

MatrixX3d random_net(int degree_u, int degree_v, int seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> unit(-1, 1);
  return MatrixX3d::NullaryExpr((degree_u + 1) * (degree_v + 1), 3, [&] { return unit(random); });
}

// Stripes between random points of opposite sides, exactly on the surface: of degree_u + degree_v.
std::vector<BezierStripe> stripes_on(const MatrixX3d& net, int degree_u, int degree_v, int count,
                                     int seed = 3) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> unit(0, 1);
  std::vector<BezierStripe> stripes;
  for (int s = 0; s < count; ++s) {
    BezierStripe stripe;
    stripe.from = s % 2 == 0 ? Vector2d(unit(random), 0) : Vector2d(0, unit(random));
    stripe.to = s % 2 == 0 ? Vector2d(unit(random), 1) : Vector2d(1, unit(random));
    stripe.control =
        bench::literal_rows<bench::ByRecurrence>(degree_u, degree_v, stripe.from, stripe.to) * net;
    stripes.push_back(stripe);
  }
  return stripes;
}

double condition_by_svd(const MatrixXd& matrix) {
  const Eigen::VectorXd values = Eigen::JacobiSVD<MatrixXd>(matrix).singularValues();
  return values[0] / values[values.size() - 1];
}

}  // namespace

TEST_CASE("stripes on a Bezier surface give its control points back, by QR to the condition's bound") {
  for (const auto& [nu, nv] : {std::pair{3, 3}, {2, 4}, {6, 5}}) {
    const MatrixX3d net = random_net(nu, nv, 5);
    const auto stripes = stripes_on(net, nu, nv, 30);
    const auto qr = fit_bezier_surface(stripes, {.degree_u = nu, .degree_v = nv});
    REQUIRE(qr.has_value());
    CHECK((qr->control - net).cwiseAbs().maxCoeff() < qr->unknowns * qr->condition * eps);
    CHECK(qr->max_mm < 1e-13);
    CHECK(qr->equations == 30 * (nu + nv + 1));
    CHECK(qr->unknowns == (nu + 1) * (nv + 1));
    const auto normal = fit_bezier_surface(
        stripes, {.degree_u = nu, .degree_v = nv, .method = LeastSquares::normal_equations});
    REQUIRE(normal.has_value());
    CHECK((normal->control - net).cwiseAbs().maxCoeff() < qr->unknowns * qr->condition * qr->condition * eps);
  }
}

TEST_CASE("the condition that is reported is that of the singular values") {
  const MatrixX3d net = random_net(4, 4, 6);
  const auto stripes = stripes_on(net, 4, 4, 20);
  const auto fit = fit_bezier_surface(stripes, {.degree_u = 4, .degree_v = 4});
  REQUIRE(fit.has_value());
  MatrixXd matrix;
  matching_matrix(4, 4, stripes, matrix);
  const double truth = condition_by_svd(matrix);
  CHECK(fit->condition < truth * (1 + 1e-9));
  CHECK(fit->condition > truth / 2);
}

TEST_CASE("a boundary that is given stays, and the inner control points are the least squares ones") {
  const int nu = 4, nv = 5;
  const MatrixX3d net = random_net(nu, nv, 7);
  auto stripes = stripes_on(net, nu, nv, 12);
  std::mt19937 random(8);
  std::uniform_real_distribution<double> unit(-0.1, 0.1);
  for (auto& stripe : stripes)
    stripe.control = stripe.control.unaryExpr([&](double c) { return c + unit(random); });
  const auto fit = fit_bezier_surface(stripes, {.degree_u = nu, .degree_v = nv, .boundary = net});
  REQUIRE(fit.has_value());
  CHECK(fit->unknowns == (nu - 1) * (nv - 1));

  // Dense, from the literal matrix: the gradient of the sum of squares vanishes in every inner control point.
  MatrixXd gradient = MatrixXd::Zero(net.rows(), 3);
  for (const auto& stripe : stripes) {
    const MatrixXd rows = bench::literal_rows<bench::ByDefinition>(nu, nv, stripe.from, stripe.to);
    gradient += rows.transpose() * (rows * fit->control - bench::literal_side(stripe.control, nu + nv));
  }
  for (int i = 0; i <= nu; ++i) {
    for (int j = 0; j <= nv; ++j) {
      const bool inner = i > 0 && i < nu && j > 0 && j < nv;
      if (inner)
        CHECK(gradient.row(i * (nv + 1) + j).norm() < 1e-13);
      else
        CHECK(fit->control.row(i * (nv + 1) + j) == net.row(i * (nv + 1) + j));
    }
  }
}

TEST_CASE("where the normal equations break down the condition says so, and QR goes on") {
  // Fifty-four stripes as nine shots leave them: six in each third of a third, none longer than that.
  const int n = 16;
  const MatrixX3d net = random_net(n, n, 9);
  std::vector<BezierStripe> stripes;
  for (int s = 0; s < 54; ++s) {
    const double column = s / 18, row = s / 6 % 3, offset = (s % 6 + 0.5) / 18;
    BezierStripe stripe{
        {}, Vector2d(column / 3, row / 3 + offset), Vector2d((column + 1) / 3, row / 3 + 0.9 * offset)};
    stripe.control = bench::literal_rows<bench::ByRecurrence>(n, n, stripe.from, stripe.to) * net;
    stripes.push_back(stripe);
  }
  const auto qr = fit_bezier_surface(stripes, {.degree_u = n, .degree_v = n});
  REQUIRE(qr.has_value());
  CHECK(qr->condition > 1e6);
  CHECK(qr->max_mm < 1e-12);
  CHECK((qr->control - net).cwiseAbs().maxCoeff() < qr->unknowns * qr->condition * eps);
  const auto normal =
      fit_bezier_surface(stripes, {.degree_u = n, .degree_v = n, .method = LeastSquares::normal_equations});
  if (normal.has_value())
    CHECK((normal->control - net).cwiseAbs().maxCoeff() > 1e3 * (qr->control - net).cwiseAbs().maxCoeff());
  else
    CHECK(normal.error().error == Error::singular);
}

TEST_CASE("stripes that leave a Bezier surface free are refused by name") {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const MatrixX3d net = random_net(3, 3, 10);
  const auto good = stripes_on(net, 3, 3, 10);
  const auto with = [&](auto&& change) {
    auto stripes = good;
    change(stripes);
    const auto fit = fit_bezier_surface(stripes, {});
    REQUIRE(!fit.has_value());
    return fit.error();
  };
  CHECK(with([](auto& s) { s.resize(2); }).error == Error::too_few_stripes);
  CHECK(with([](auto& s) { s.clear(); }).error == Error::too_few_stripes);
  auto failure = with([&](auto& s) { s[4].control(1, 2) = nan; });
  CHECK(failure.error == Error::not_finite);
  CHECK(failure.stripe == 4);
  CHECK(with([](auto& s) { s[5].to = s[5].from; }).error == Error::no_length);
  CHECK(with([](auto& s) { s[5].to.x() = 1.01; }).error == Error::preimage_outside);
  CHECK(with([](auto& s) { s[5].control = MatrixX3d::Zero(8, 3); }).error == Error::too_few_points);
  failure = with([](auto& s) { s[7].from = s[2].to, s[7].to = s[2].from; });
  CHECK(failure.error == Error::coincident_stripes);
  CHECK(failure.stripe == 7);
  CHECK(failure.other == 2);

  // All along v: three of them cannot tell four columns of control points apart.
  std::vector<BezierStripe> parallel;
  for (const double u : {0.1, 0.5, 0.9})
    parallel.push_back({MatrixX3d::Zero(4, 3), Vector2d(u, 0), Vector2d(u, 1)});
  for (const LeastSquares method : {LeastSquares::qr, LeastSquares::normal_equations}) {
    const auto fit = fit_bezier_surface(parallel, {.method = method});
    REQUIRE(!fit.has_value());
    CHECK(fit.error().error == Error::singular);
    CHECK(fit.error().control.i >= 0);
    if (method == LeastSquares::qr) CHECK(fit.error().condition > 1e13);
    CHECK(fit.error().control.j >= 0);
  }
}
