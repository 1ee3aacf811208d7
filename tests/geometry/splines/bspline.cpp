#include "geometry/splines/bspline.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <random>

using namespace moldloft::geometry;

namespace {

// The definition (thesis eq. 2.45), slow and plain: N_i of degree p at t.
double basis(const std::vector<double>& knots, int i, int p, double t) {
  if (p == 0) return knots[i] <= t && t < knots[i + 1] ? 1 : 0;
  double sum = 0;
  if (knots[i + p] > knots[i]) sum += (t - knots[i]) / (knots[i + p] - knots[i]) * basis(knots, i, p - 1, t);
  if (knots[i + p + 1] > knots[i + 1]) {
    sum += (knots[i + p + 1] - t) / (knots[i + p + 1] - knots[i + 1]) * basis(knots, i + 1, p - 1, t);
  }
  return sum;
}

const std::vector<double> uneven{0, 0, 0, 0, 0.1, 0.35, 0.35, 0.8, 1, 1, 1, 1};

}  // namespace

TEST_CASE("basis values are those of the definition, on even and uneven knots") {
  for (const auto& knots : {uniform_clamped_knots(1), uniform_clamped_knots(5), uneven}) {
    for (double t = 0; t < 1; t += 0.013) {
      const int k = find_span(knots, t);
      CHECK((knots[k] <= t && t < knots[k + 1]));
      const BasisValues values = cubic_basis(knots, k, t);
      for (int i = 0; i < 4; ++i) CHECK(std::abs(values.value[i] - basis(knots, k - 3 + i, 3, t)) < 1e-15);
    }
  }
}

TEST_CASE("basis derivatives are those of differenced lower degrees") {
  const auto& knots = uneven;
  for (double t = 0.0; t < 1; t += 0.017) {
    const int k = find_span(knots, t);
    const BasisValues values = cubic_basis(knots, k, t);
    const auto ratio = [&](double n, int a, int b) {
      return knots[b] > knots[a] ? n / (knots[b] - knots[a]) : 0.0;
    };
    for (int i = 0; i < 4; ++i) {
      const int j = k - 3 + i;
      const double first =
          3 * (ratio(basis(knots, j, 2, t), j, j + 3) - ratio(basis(knots, j + 1, 2, t), j + 1, j + 4));
      const auto lower = [&](int m) {
        return 2 * (ratio(basis(knots, m, 1, t), m, m + 2) - ratio(basis(knots, m + 1, 1, t), m + 1, m + 3));
      };
      const double second = 3 * (ratio(lower(j), j, j + 3) - ratio(lower(j + 1), j + 1, j + 4));
      CHECK(values.first[i] == doctest::Approx(first).epsilon(1e-12));
      CHECK(values.second[i] == doctest::Approx(second).epsilon(1e-11));
    }
  }
}

TEST_CASE("the ends of the domain belong to the first and last span") {
  const std::vector<double> knots = uniform_clamped_knots(4);
  CHECK(knots.size() == 11);
  CHECK(find_span(knots, 0) == 3);
  CHECK(find_span(knots, -1) == 3);
  CHECK(find_span(knots, 0.25) == 4);
  CHECK(find_span(knots, 1) == 6);
  CHECK(find_span(knots, 2) == 6);
  CHECK(cubic_basis(knots, 6, 1.0).value[3] == 1);
}

TEST_CASE("a curve with its control points at the Greville abscissae is a straight line at unit speed") {
  PlanCurve line{uneven, {}};
  for (std::size_t i = 0; i + 4 < uneven.size(); ++i) {
    const double g = (uneven[i + 1] + uneven[i + 2] + uneven[i + 3]) / 3;
    line.control.push_back({10 * g, 5 - 20 * g});
  }
  for (double t = 0; t <= 1; t += 0.05) {
    CHECK((line.at(t).value - Eigen::Vector2d(10 * t, 5 - 20 * t)).norm() < 1e-13);
    CHECK((line.at(t).first - Eigen::Vector2d(10, -20)).norm() < 1e-12);
    CHECK(line.at(t).second.norm() < 1e-10);
  }
}

TEST_CASE("a surface's derivatives are the limits of its differences") {
  std::mt19937 random(2);
  std::uniform_real_distribution<double> number(-1, 1);
  BSplineSurface surface{uneven, uniform_clamped_knots(5), {}, {}, {}};
  for (Eigen::MatrixXd* net : {&surface.x, &surface.y, &surface.z}) {
    *net = Eigen::MatrixXd::NullaryExpr(8, 8, [&] { return number(random); });
  }
  const double h = 1e-5;
  for (const auto& [u, v] : {std::pair{0.21, 0.33}, {0.6, 0.71}, {0.93, 0.07}}) {
    const SurfacePoint p = surface.at(u, v);
    CHECK((p.du - (surface.at(u + h, v).value - surface.at(u - h, v).value) / (2 * h)).norm() < 1e-7);
    CHECK((p.dv - (surface.at(u, v + h).value - surface.at(u, v - h).value) / (2 * h)).norm() < 1e-7);
    CHECK((p.duu - (surface.at(u + h, v).du - surface.at(u - h, v).du) / (2 * h)).norm() < 1e-5);
    CHECK((p.duv - (surface.at(u, v + h).du - surface.at(u, v - h).du) / (2 * h)).norm() < 1e-5);
    CHECK((p.dvv - (surface.at(u, v + h).dv - surface.at(u, v - h).dv) / (2 * h)).norm() < 1e-5);
    CHECK(std::abs(p.normal().dot(p.du)) < 1e-12);
  }
}
