#include "geometry/splines/bspline.hpp"

#include "geometry/heap_watch.hpp"
#include "geometry/splines/spline_samples.hpp"

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

TEST_CASE("curves of any degree have the values and derivatives of the definition") {
  samples::Numbers numbers;
  for (int p : {1, 2, 3, 4, 6}) {
    const auto curve = numbers.curve<2>(p, 7);
    double first_net = 0;  // the largest control point of the derivative
    for (std::size_t i = 1; i < curve.control.size(); ++i) {
      const double run = curve.knots[i + p] - curve.knots[i];
      first_net =
          std::max(first_net, p / run * (curve.control[i] - curve.control[i - 1]).cwiseAbs().maxCoeff());
    }
    for (double t = 0; t <= 1; t += 0.0217) {
      const CurvePoint2 at = curve.at(t);
      for (int axis = 0; axis < 2; ++axis) {
        CHECK(std::abs(at.value[axis] - samples::exact(curve, axis, t)) <= 8 * p * samples::eps);
        CHECK(std::abs(curve.de_boor(t)[axis] - samples::exact(curve, axis, t)) <= 8 * p * samples::eps);
        if (p > 1 && t > 0) {
          CHECK(std::abs(at.first[axis] - samples::exact(curve, axis, t, 1)) <=
                8 * p * samples::eps * first_net);
        }
      }
    }
    for (const auto& [t, end] : {std::pair{0, curve.control.front()}, {1, curve.control.back()}}) {
      CHECK((curve.at(t).value - end).cwiseAbs().maxCoeff() <= 8 * p * samples::eps);
      CHECK(curve.de_boor(t) == end);
    }
    CHECK(curve.at(-3).value == curve.at(0).value);
  }
}

TEST_CASE("surfaces of any degree have the values and derivatives of the definition") {
  samples::Numbers numbers;
  for (const auto& [p, q] : {std::pair{3, 3}, {1, 1}, {2, 3}, {3, 4}, {5, 1}}) {
    const BSplineSurface s = numbers.surface(p, 5, q, 4);
    CHECK(check(s).has_value());
    for (const auto& [u, v] : {std::pair{0.013, 0.93}, {0.41, 0.37}, {0.77, 0.5}, {0.999, 0.002}}) {
      const SurfacePoint at = s.at(u, v);
      const Eigen::MatrixXd* nets[3] = {&s.x, &s.y, &s.z};
      // Every derivative's error is held against the same sum made of absolute values.
      const auto bound = [&](int mu, int mv) {
        double along_u = 0, along_v = 0;
        for (int i = 0; i < s.control_u(); ++i)
          along_u += static_cast<double>(samples::basis_derivative(s.knots_u, i, p, mu, u, 1));
        for (int j = 0; j < s.control_v(); ++j)
          along_v += static_cast<double>(samples::basis_derivative(s.knots_v, j, q, mv, v, 1));
        return 8 * (p + q) * samples::eps * along_u * along_v;
      };
      for (int axis = 0; axis < 3; ++axis) {
        const auto exact = [&](int mu, int mv) { return samples::exact(s, *nets[axis], u, v, mu, mv); };
        CHECK(std::abs(at.value[axis] - exact(0, 0)) <= 8 * (p + q) * samples::eps);
        CHECK(std::abs(at.du[axis] - exact(1, 0)) <= bound(1, 0));
        CHECK(std::abs(at.dv[axis] - exact(0, 1)) <= bound(0, 1));
        CHECK(std::abs(at.duu[axis] - exact(2, 0)) <= bound(2, 0));
        CHECK(std::abs(at.duv[axis] - exact(1, 1)) <= bound(1, 1));
        CHECK(std::abs(at.dvv[axis] - exact(0, 2)) <= bound(0, 2));
      }
    }
  }
}

TEST_CASE("the corners of a surface are those of its net") {
  samples::Numbers numbers;
  for (const BSplineSurface& s : {numbers.surface(3, 4, 3, 2), numbers.surface(2, 4, 4, 2)}) {
    const int m = s.control_u() - 1, n = s.control_v() - 1;
    for (const auto& [u, i] : {std::pair{0, 0}, {1, m}}) {
      for (const auto& [v, j] : {std::pair{0, 0}, {1, n}}) {
        const Eigen::Vector3d corner(s.x(i, j), s.y(i, j), s.z(i, j));
        CHECK((s.at(u, v).value - corner).cwiseAbs().maxCoeff() <= 8 * 6 * samples::eps);
        if (!s.bicubic()) CHECK(s.at(u, v).value == corner);
      }
    }
  }
}

TEST_CASE("evaluation takes no memory") {
  samples::Numbers numbers;
  const BSplineSurface cubics = numbers.surface(3, 4, 3, 2), mixed = numbers.surface(2, 4, 4, 2);
  const SpaceCurve curve = numbers.curve<3>(5, 3);
  const std::size_t before = moldloft::test::allocations();
  double sum = 0;
  for (double t = 0; t < 1; t += 0.1)
    sum +=
        cubics.at(t, 1 - t).duv.x() + mixed.at(t, t).dvv.y() + curve.at(t).value.x() + curve.de_boor(t).z();
  const std::size_t taken = moldloft::test::allocations() - before;
  CHECK(taken == 0);
  CHECK(std::isfinite(sum));
}

TEST_CASE("an affine map of the net is the affine map of the surface") {
  samples::Numbers numbers;
  const BSplineSurface s = numbers.surface(3, 5, 3, 3);
  BSplineSurface moved = s;
  moved.x = 0.5 * s.x - 2 * s.z + Eigen::MatrixXd::Constant(s.x.rows(), s.x.cols(), 3);
  for (double u = 0; u <= 1; u += 0.11) {
    const SurfacePoint a = s.at(u, 1 - u), b = moved.at(u, 1 - u);
    CHECK(std::abs(b.value.x() - (0.5 * a.value.x() - 2 * a.value.z() + 3)) <= 2 * 48 * samples::eps * 5.5);
    CHECK(b.value.y() == a.value.y());
  }
}

TEST_CASE("a curve or surface from outside is checked with its control points") {
  samples::Numbers numbers;
  PlanCurve curve = numbers.curve<2>(3, 3);
  CHECK(check(curve).has_value());
  curve.control[2].y() = std::nan("");
  CHECK(check(curve).error() == Error::not_finite);
  curve.control.pop_back();
  CHECK(check(curve).error() == Error::knots_wrong_count);
  BSplineSurface s = numbers.surface(3, 2, 3, 2);
  s.z.resize(3, 3);
  CHECK(check(s).error() == Error::knots_wrong_count);
  s = numbers.surface(3, 2, 3, 2);
  s.y(1, 1) = std::numeric_limits<double>::infinity();
  CHECK(check(s).error() == Error::not_finite);
  s = numbers.surface(3, 2, 3, 2);
  s.knots_v[4] = 2;
  CHECK(check(s).error() == Error::knots_not_increasing);
}
