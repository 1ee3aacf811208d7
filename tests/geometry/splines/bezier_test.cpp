#include "geometry/splines/bezier.hpp"

#include "geometry/heap_watch.hpp"
#include "geometry/splines/spline_samples.hpp"

#include <doctest/doctest.h>

using namespace moldloft::geometry;
using samples::eps, samples::Numbers;

namespace {

// A Bezier curve is the B-spline without interior knots, whose definition the samples know.
template <int dim>
BSplineCurve<dim> as_spline(const BezierCurve<dim>& curve) {
  BSplineCurve<dim> spline{uniform_clamped_knots(1, curve.degree()), {}, curve.degree()};
  for (Eigen::Index i = 0; i < curve.control.rows(); ++i)
    spline.control.push_back(curve.control.row(i).transpose());
  return spline;
}

BSplineSurface as_spline(const BezierSurface& s) {
  return {uniform_clamped_knots(1, s.degree_u()),
          uniform_clamped_knots(1, s.degree_v()),
          s.x,
          s.y,
          s.z,
          s.degree_u(),
          s.degree_v()};
}

BezierCurve<2> some_curve(Numbers& numbers, int degree) {
  return {Eigen::MatrixXd::NullaryExpr(degree + 1, 2, [&] { return numbers.in(-1, 1); })};
}

BezierSurface some_surface(Numbers& numbers, int degree_u, int degree_v) {
  const auto net = [&]() -> Eigen::MatrixXd {
    return Eigen::MatrixXd::NullaryExpr(degree_u + 1, degree_v + 1, [&] { return numbers.in(-1, 1); });
  };
  return {net(), net(), net()};
}

}  // namespace

TEST_CASE("a Bezier curve has the values and derivatives of its polynomial") {
  Numbers numbers;
  for (int n : {0, 1, 2, 3, 6, 9}) {
    const auto curve = some_curve(numbers, n);
    const auto spline = as_spline(curve);
    for (const double t : {0.0, 0.21, 0.5, 0.87, 1.0}) {
      const auto at = curve.at(t);
      for (int axis = 0; axis < 2; ++axis) {
        CHECK(std::abs(at.value[axis] - samples::exact(spline, axis, t)) <= (4 * n + 1) * eps);
        CHECK(std::abs(at.first[axis] - samples::exact(spline, axis, t, 1)) <= (4 * n + 1) * eps * 2 * n);
        CHECK(std::abs(at.second[axis] - samples::exact(spline, axis, t, 2)) <=
              (4 * n + 1) * eps * 4 * n * n);
      }
    }
    CHECK(curve.at(0).value == curve.control.row(0).transpose());
    CHECK(curve.at(1).value == curve.control.row(n).transpose());
  }
}

TEST_CASE("a Bezier surface has the values and derivatives of its polynomial") {
  Numbers numbers;
  for (const auto& [n, m] : {std::pair{3, 3}, {1, 4}, {0, 2}, {6, 5}}) {
    const BezierSurface surface = some_surface(numbers, n, m);
    const BSplineSurface spline = as_spline(surface);
    for (const auto& [u, v] : {std::pair{0.0, 0.3}, {0.24, 0.77}, {0.5, 0.5}, {1.0, 1.0}}) {
      const SurfacePoint at = surface.at(u, v);
      const double bound = 4 * (n + m) * eps;
      const auto exact = [&](int mu, int mv) { return samples::exact(spline, spline.z, u, v, mu, mv); };
      CHECK(std::abs(at.value.z() - exact(0, 0)) <= bound);
      CHECK(std::abs(at.du.z() - exact(1, 0)) <= bound * 2 * n);
      CHECK(std::abs(at.dv.z() - exact(0, 1)) <= bound * 2 * m);
      CHECK(std::abs(at.duu.z() - exact(2, 0)) <= bound * 4 * n * n);
      CHECK(std::abs(at.duv.z() - exact(1, 1)) <= bound * 4 * n * m);
      CHECK(std::abs(at.dvv.z() - exact(0, 2)) <= bound * 4 * m * m);
    }
  }
}

TEST_CASE("halved, raised and restricted Bezier curves are the curve") {
  Numbers numbers;
  for (int n : {1, 3, 8}) {
    const auto curve = some_curve(numbers, n);
    const auto spline = as_spline(curve);
    const auto [left, right] = split(curve, 0.3);
    const auto raised = elevate(curve, n + 3), part = restrict_to(curve, 0.9, 0.2);
    CHECK(raised.degree() == n + 3);
    for (const double s : {0.0, 0.1, 0.45, 0.8, 1.0}) {
      const auto off = [&](const BezierCurve<2>& of, long double t) {
        return std::abs(samples::exact(as_spline(of), 1, s) - samples::exact(spline, 1, t));
      };
      CHECK(off(left, static_cast<long double>(0.3) * s) <= 4 * n * eps);
      CHECK(off(right, 0.3 + (1 - static_cast<long double>(0.3)) * s) <= 4 * n * eps);
      CHECK(off(raised, s) <= 4 * n * eps);
      CHECK(off(part, 0.9 + (static_cast<long double>(0.2) - 0.9) * s) <= 4 * n * eps);
    }
  }
}

TEST_CASE("raised and restricted Bezier surfaces are the surface") {
  Numbers numbers;
  const BezierSurface surface = some_surface(numbers, 3, 4);
  const BSplineSurface spline = as_spline(surface);
  const BezierSurface raised = elevate(surface, 5, 6);
  const ParameterBox box{0.25, 0.75, 0.875, 0.125};
  const BezierSurface part = restrict_to(surface, box);
  for (const auto& [s, t] : {std::pair{0.0, 0.0}, {0.3, 0.8}, {1.0, 0.6}}) {
    const BSplineSurface of_raised = as_spline(raised), of_part = as_spline(part);
    CHECK(std::abs(samples::exact(of_raised, of_raised.x, s, t) - samples::exact(spline, spline.x, s, t)) <=
          4 * 7 * eps);
    const double whole = samples::exact(spline, spline.y, 0.25L + 0.5L * s, 0.875L - 0.75L * t);
    CHECK(std::abs(samples::exact(of_part, of_part.y, s, t) - whole) <= 4 * 7 * eps);
  }
}

TEST_CASE("the Bezier pieces of a curve agree with de Boor") {
  Numbers numbers;
  for (int p : {1, 2, 3, 5}) {
    const auto curve = numbers.curve<3>(p, 6);
    const auto pieces = bezier_pieces(curve);
    CHECK(pieces.front().begin == 0);
    CHECK(pieces.back().end == 1);
    CHECK(pieces.front().curve.control.row(0).transpose() == curve.control.front());
    for (std::size_t i = 0; i < pieces.size(); ++i) {
      const auto& [begin, end, piece] = pieces[i];
      if (i > 0) {
        CHECK(begin == pieces[i - 1].end);
        const auto last = pieces[i - 1].curve.control.row(p);
        CHECK((piece.control.row(0) - last).cwiseAbs().maxCoeff() <= 8 * p * eps);
      }
      for (const double s : {0.1, 0.5, 0.9}) {
        const long double t = begin + (static_cast<long double>(end) - begin) * s;
        CHECK(std::abs(samples::exact(as_spline(piece), 2, s) - samples::exact(curve, 2, t)) <=
              (4 * p + 1) * eps);
        CHECK((piece.at(s).value - curve.de_boor(begin + (end - begin) * s)).norm() < 1e-13);
      }
    }
  }
}

TEST_CASE("the Bezier patches of a surface tile it") {
  Numbers numbers;
  const BSplineSurface s = numbers.surface(3, 3, 2, 2);
  const auto patches = bezier_patches(s);
  CHECK(patches.size() == filled_spans(s.knots_u, 3).size() * filled_spans(s.knots_v, 2).size());
  CHECK(patches[1].box.begin_u == patches[0].box.end_u);
  CHECK(patches[1].box.begin_v == patches[0].box.begin_v);
  double area = 0;
  for (const auto& [box, patch] : patches) {
    area += (box.end_u - box.begin_u) * (box.end_v - box.begin_v);
    const BSplineSurface as = as_spline(patch);
    for (const auto& [a, b] : {std::pair{0.2L, 0.7L}, {0.5L, 0.1L}}) {
      const long double u = box.begin_u + (static_cast<long double>(box.end_u) - box.begin_u) * a;
      const long double v = box.begin_v + (static_cast<long double>(box.end_v) - box.begin_v) * b;
      CHECK(std::abs(samples::exact(as, as.z, a, b) - samples::exact(s, s.z, u, v)) <= (4 * 5 + 1) * eps);
    }
  }
  CHECK(area == doctest::Approx(1).epsilon(1e-14));
}

TEST_CASE("evaluating Bezier curves and surfaces takes no memory") {
  Numbers numbers;
  const auto curve = some_curve(numbers, 7);
  const BezierSurface surface = some_surface(numbers, 5, 6);
  const std::size_t before = moldloft::test::allocations();
  double sum = 0;
  for (double t = 0; t < 1; t += 0.1) sum += curve.at(t).second.x() + surface.at(t, 1 - t).duv.y();
  const std::size_t taken = moldloft::test::allocations() - before;
  CHECK(taken == 0);
  CHECK(std::isfinite(sum));
}
