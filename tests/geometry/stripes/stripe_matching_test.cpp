#include "geometry/stripes/stripe_matching.hpp"

#include "bench/literal_matching.hpp"
#include "geometry/splines/bernstein_form.hpp"
#include "geometry/splines/span_restriction.hpp"

#include <doctest/doctest.h>

#include <random>

using namespace moldloft;
using namespace moldloft::geometry;
using Eigen::MatrixXd, Eigen::Vector2d;

namespace {

MatrixXd rows_of(int n1, int n2, const Vector2d& a, const Vector2d& b) {
  MatrixXd rows(n1 + n2 + 1, (n1 + 1) * (n2 + 1));
  fill_matching_rows(n1, n2, a, b, rows);
  return rows;
}

}  // namespace

TEST_CASE("the rows of a stripe are those of the six nested loops") {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> unit(0, 1);
  for (const auto& [n1, n2] : {std::pair{1, 1}, {3, 3}, {2, 5}, {7, 7}, {9, 6}}) {
    for (int trial = 0; trial < 4; ++trial) {
      const Vector2d a(unit(random), unit(random)), b(unit(random), trial == 0 ? a.y() : unit(random));
      const MatrixXd rows = rows_of(n1, n2, a, b);
      CHECK((rows - bench::literal_rows<bench::ByDefinition>(n1, n2, a, b)).cwiseAbs().maxCoeff() < 1e-14);
      CHECK((rows - bench::literal_rows<bench::ByRecurrence>(n1, n2, a, b)).cwiseAbs().maxCoeff() < 1e-14);
    }
  }
}

TEST_CASE("the rows times the control points are the Bernstein coefficients of the surface along the line") {
  std::mt19937 random(8);
  std::uniform_real_distribution<double> unit(0, 1);
  for (const auto& [n1, n2] : {std::pair{3, 3}, {4, 7}, {24, 24}}) {
    const Vector2d a(unit(random), unit(random)), b(unit(random), unit(random));
    const Eigen::VectorXd net =
        Eigen::VectorXd::NullaryExpr((n1 + 1) * (n2 + 1), [&] { return unit(random); });
    const Eigen::VectorXd form = rows_of(n1, n2, a, b) * net;
    for (const double t : {0.0, 0.2, 0.5, 0.77, 1.0}) {
      const Vector2d uv = (1 - t) * a + t * b;
      const Eigen::VectorXd bu = bernstein_basis(n1, uv.x()), bv = bernstein_basis(n2, uv.y());
      double surface = 0;
      for (int i = 0; i <= n1; ++i)
        for (int j = 0; j <= n2; ++j) surface += bu[i] * bv[j] * net[i * (n2 + 1) + j];
      // Weights that are nonnegative and add up to 1, each within some 4 (n1 + n2) eps: so is the mean
      // of [0, 1].
      CHECK(std::abs(bernstein_basis(n1 + n2, t).dot(form) - surface) < 8 * (n1 + n2) * 2.3e-16);
    }
  }
}

TEST_CASE("every row adds up to one, since a surface of equal control points is that point") {
  const MatrixXd rows = rows_of(24, 24, {0.03, 0.9}, {0.98, 0.2});
  CHECK((rows.rowwise().sum().array() - 1).abs().maxCoeff() < 4 * 48 * 2.3e-16);
  CHECK(rows.minCoeff() >= 0);
}

TEST_CASE("the right side is the stripe, its degree raised as the thesis raises it") {
  std::mt19937 random(9);
  std::uniform_real_distribution<double> unit(-1, 1);
  for (const auto& [n3, raised] : {std::pair{3, 6}, {5, 14}, {6, 6}, {3, 48}}) {
    const Eigen::MatrixX3d d = Eigen::MatrixX3d::NullaryExpr(n3 + 1, 3, [&] { return unit(random); });
    const Eigen::MatrixX3d g = matching_side(d, raised);
    CHECK((g - bench::literal_side(d, raised)).cwiseAbs().maxCoeff() < 1e-15);
    CHECK((form_at(g, 0.3) - form_at(d, 0.3)).norm() < 8 * raised * 2.3e-16);
    if (n3 == 3 && raised == 6) CHECK((g - sextic_side(d)).cwiseAbs().maxCoeff() < 1e-15);
  }
}

TEST_CASE(
    "the bicubic rows of a piece are those of a Bezier patch whose control points knot insertion gives") {
  const std::vector<double> u{0, 0, 0, 0, 0.2, 0.5, 0.9, 1, 1, 1, 1}, v{0, 0, 0, 0, 0.3, 0.6, 1, 1, 1, 1};
  const int ku = 5, kv = 4;  // cell [0.5, 0.9] x [0.3, 0.6]
  const Vector2d a(0.55, 0.58), b(0.83, 0.31);
  const BicubicRows rows =
      bicubic_rows(span_restriction(u, ku, a.x(), b.x()), span_restriction(v, kv, a.y(), b.y()));

  // Equations (3.20-3.34): the patch's control points from the B-spline's, then (3.13) on the patch.
  const Eigen::Matrix4d to_u = span_restriction(u, ku, u[ku], u[ku + 1]);
  const Eigen::Matrix4d to_v = span_restriction(v, kv, v[kv], v[kv + 1]);
  const auto local = [&](const Vector2d& p) { return Vector2d((p.x() - 0.5) / 0.4, (p.y() - 0.3) / 0.3); };
  const MatrixXd patch = bench::literal_rows<bench::ByRecurrence>(3, 3, local(a), local(b));
  for (int i = 0; i < 4; ++i) {
    for (int j = 0; j < 4; ++j) {
      Eigen::VectorXd expected = Eigen::VectorXd::Zero(7);
      for (int k = 0; k < 4; ++k)
        for (int l = 0; l < 4; ++l) expected += to_u(i, k) * to_v(j, l) * patch.col(4 * k + l);
      CHECK((rows.row(4 * i + j).transpose() - expected).cwiseAbs().maxCoeff() < 1e-15);
    }
  }
}
