#include "geometry/splines/refinement.hpp"

#include "geometry/splines/spline_samples.hpp"

#include <doctest/doctest.h>

using namespace moldloft::geometry;
using samples::eps, samples::exact, samples::Numbers;

namespace {

const std::vector<double> places{0, 0.013, 0.11, 0.2504, 0.37, 0.5, 0.61, 0.777, 0.93, 1};

// Both splines evaluated by the definition in extended precision, so that only the change of
// form is measured.
template <int dim>
double distance(const BSplineCurve<dim>& a, const BSplineCurve<dim>& b) {
  double most = 0;
  for (const double t : places)
    for (int axis = 0; axis < dim; ++axis)
      most = std::max(most, std::abs(exact(a, axis, t) - exact(b, axis, t)));
  return most;
}

double distance(const BSplineSurface& a, const BSplineSurface& b) {
  double most = 0;
  for (const auto& [u, v] :
       {std::pair{0.0, 0.0}, {0.11, 0.83}, {0.37, 0.37}, {0.61, 0.05}, {0.93, 0.5}, {1.0, 1.0}}) {
    most = std::max(most, std::abs(exact(a, a.x, u, v) - exact(b, b.x, u, v)));
    most = std::max(most, std::abs(exact(a, a.y, u, v) - exact(b, b.y, u, v)));
    most = std::max(most, std::abs(exact(a, a.z, u, v) - exact(b, b.z, u, v)));
  }
  return most;
}

}  // namespace

TEST_CASE("Boehm's insertion at the middle of a Bezier curve halves it like de Casteljau") {
  PlanCurve curve{uniform_clamped_knots(1), {{0, 0}, {0, 8}, {8, 8}, {8, 0}}};
  const PlanCurve full = refine(curve, with_full_knot(curve.knots, 3, 0.5));
  CHECK(full.control == std::vector<Eigen::Vector2d>{{0, 0}, {0, 4}, {2, 6}, {4, 6}, {6, 6}, {8, 4}, {8, 0}});
}

TEST_CASE("knots inserted anywhere leave a curve alone") {
  Numbers numbers;
  for (int p : {1, 2, 3, 4, 6}) {
    for (int trial = 0; trial < 5; ++trial) {
      const auto curve = numbers.curve<2>(p, numbers.of(0, 6));
      const std::vector<double> more = numbers.knots(p, numbers.of(1, 12));
      const auto fine_knots = merge_knots(curve.knots, more);
      const auto fine = refine(curve, fine_knots);
      CHECK(check(fine).has_value());
      CHECK(fine.knots == fine_knots);
      const auto inserted = static_cast<int>(fine.knots.size() - curve.knots.size());
      CHECK(distance(curve, fine) <= 4 * (p + inserted) * eps);
    }
  }
}

TEST_CASE("refinement is a matrix of shares") {
  Numbers numbers;
  const auto coarse = numbers.knots(3, 4), fine = merge_knots(coarse, numbers.knots(3, 9));
  const Eigen::MatrixXd m = refinement_matrix(coarse, 3, fine);
  CHECK(m.minCoeff() >= 0);
  for (int i = 0; i < m.rows(); ++i) {
    CHECK(std::abs(m.row(i).sum() - 1) <= 4 * (3 + 9) * eps);
    CHECK((m.row(i).array() != 0).count() <= 4);
  }
}

TEST_CASE("all control points at once are those of the blossom one by one") {
  Numbers numbers;
  const auto curve = numbers.curve<1>(3, 5);
  const auto fine = refine(curve, merge_knots(curve.knots, uniform_clamped_knots(7)));
  const std::span coefficients{curve.control.front().data(), curve.control.size()};
  for (int i = 0; i < static_cast<int>(fine.control.size()); ++i) {
    const double one = refined_coefficient(curve.knots, coefficients, fine.knots, i);
    CHECK(std::abs(one - fine.control[i][0]) <
          1e-12);  // the triangle may extrapolate, by how much the knots say
  }
}

TEST_CASE("a raised degree leaves a curve alone") {
  // A straight line through three degrees: control points at the Greville abscissae.
  HeightCurve steps{uniform_clamped_knots(2, 1), {}, 1};
  for (const double height : {0.0, 1.0, 2.0}) steps.control.emplace_back(height);
  const auto line = elevate(steps, 3);
  CHECK(line.knots == std::vector{0.0, 0.0, 0.0, 0.0, 0.5, 0.5, 0.5, 1.0, 1.0, 1.0, 1.0});
  for (int i = 0; i < 7; ++i) CHECK(std::abs(line.control[i][0] - 2 * greville(line.knots, i)) <= 8 * eps);
  Numbers numbers;
  for (int p : {0, 1, 2, 3, 5}) {
    for (int trial = 0; trial < 5; ++trial) {
      const auto curve = numbers.curve<3>(p, p == 0 ? 0 : numbers.of(0, 6));
      const auto higher = elevate(curve, p + 2);
      CHECK(higher.degree == p + 2);
      CHECK(check(higher).has_value());
      const auto inserted = static_cast<int>(higher.knots.size() - curve.knots.size());
      CHECK(distance(curve, higher) <= 4 * (p + 2 + inserted) * eps);
      CHECK(higher.control.front() == curve.control.front());
      CHECK(higher.control.back() == curve.control.back());
    }
  }
}

TEST_CASE("the halves of a curve are the curve") {
  Numbers numbers;
  for (int p : {1, 2, 3, 5}) {
    const auto curve = numbers.curve<2>(p, 5);
    for (const double t : {0.3, curve.knots[p + 2]}) {  // between knots, and on one
      const auto [left, right] = split(curve, t);
      CHECK(check(left).has_value());
      CHECK(check(right).has_value());
      CHECK(left.end() == t);
      CHECK(right.begin() == t);
      CHECK(left.control.back() == right.control.front());
      for (const double s : places) {
        const auto& half = s < t ? left : right;
        CHECK(std::abs(exact(half, 0, s) - exact(curve, 0, s)) <= 4 * (p + p) * eps);
      }
    }
  }
}

TEST_CASE("a reversed curve runs the other way") {
  Numbers numbers;
  const auto curve = numbers.curve<2>(3, 4);
  const auto back = reversed(curve);
  CHECK(check(back).has_value());
  for (const double t : places) CHECK((back.value(1 - t) - curve.value(t)).norm() < 1e-14 * 100);
  CHECK(back.value(0) == curve.control.back());
}

TEST_CASE("compatible curves share degree and knots, in either order, and stay what they were") {
  Numbers numbers;
  for (int trial = 0; trial < 10; ++trial) {
    const auto a = numbers.curve<3>(2, 3), b = numbers.curve<3>(3, 5);
    auto one = a, other = b, b_first = b, a_second = a;
    make_compatible(one, other);
    make_compatible(b_first, a_second);
    CHECK(one.degree == 3);
    CHECK(one.knots == other.knots);
    CHECK(a_second.control == one.control);
    CHECK(b_first.control == other.control);
    const auto inserted = static_cast<int>(one.knots.size());
    CHECK(distance(a, one) <= 4 * (3 + inserted) * eps);
    CHECK(distance(b, other) <= 4 * (3 + inserted) * eps);
  }
  HeightCurve a = numbers.curve<1>(3, 0), b = a;
  a = refine(a, with_full_knot(a.knots, 1, 0.5)), b = refine(b, with_full_knot(b.knots, 1, 0.5 + 1e-9));
  const HeightCurve before = b;
  make_compatible(a, b, 1e-8);
  CHECK(a.knots.size() == 9);
  CHECK(distance(before, b) <= 1e-8 * 6);  // |c'| <= p times the largest difference of control points
}

TEST_CASE("refined, raised and divided surfaces are the surface") {
  Numbers numbers;
  const BSplineSurface s = numbers.surface(3, 3, 2, 2);
  const auto fine_u = merge_knots(s.knots_u, numbers.knots(3, 5)),
             fine_v = merge_knots(s.knots_v, numbers.knots(2, 4));
  const BSplineSurface fine = refine(s, fine_u, fine_v);
  CHECK(check(fine).has_value());
  CHECK(distance(s, fine) <= 4 * (3 + 5 + 2 + 4) * eps);

  const BSplineSurface higher = elevate(s, 4, 4);
  CHECK(check(higher).has_value());
  CHECK(distance(s, higher) <= 4 * (4 + 4 + 20) * eps);

  const auto [low_u, high_u] = split_u(s, 0.4);
  const auto [low_v, high_v] = split_v(s, 0.7);
  for (const BSplineSurface* part : {&low_u, &high_u, &low_v, &high_v}) CHECK(check(*part).has_value());
  for (const auto& [u, v] : {std::pair{0.1, 0.9}, {0.3, 0.2}, {0.8, 0.65}, {0.99, 0.8}}) {
    const BSplineSurface &pu = u < 0.4 ? low_u : high_u, &pv = v < 0.7 ? low_v : high_v;
    CHECK(std::abs(exact(pu, pu.z, u, v) - exact(s, s.z, u, v)) <= 4 * (3 + 3) * eps);
    CHECK(std::abs(exact(pv, pv.y, u, v) - exact(s, s.y, u, v)) <= 4 * (2 + 2) * eps);
  }
}
