// Surfaces whose distances are known without the code under test, and a slow evaluation
// in extended precision.
#pragma once

#include "geometry/rigid_motion.hpp"
#include "geometry/splines/bspline.hpp"

#include <cmath>
#include <random>
#include <vector>

namespace moldloft::test {

using Eigen::Vector3d;
using geometry::BSplineSurface;
using geometry::RigidMotion;

// The bicubic with z = height(x, y) at the Greville abscissae of a net of spans x spans over `side` mm:
// smooth, not equal to `height`, and exact where height is linear.
template <typename Height>
BSplineSurface plate(int spans, double side, const Height& height) {
  const std::vector<double> knots = geometry::uniform_clamped_knots(spans);
  const int n = spans + 3;
  BSplineSurface s{knots, knots, Eigen::MatrixXd(n, n), Eigen::MatrixXd(n, n), Eigen::MatrixXd(n, n)};
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < n; ++j) {
      s.x(i, j) = side * geometry::greville(knots, i), s.y(i, j) = side * geometry::greville(knots, j);
      s.z(i, j) = height(s.x(i, j), s.y(i, j));
    }
  }
  return s;
}

// About +-20 mm over 305 x 305 mm on 23 x 23 control points, like a plate of the yard.
inline BSplineSurface yard_plate() {
  return plate(20, 305, [](double x, double y) {
    return 14 * std::sin(x / 80 + 0.3) * std::cos(y / 100) + 1e-4 * (x - 152) * (y - 152) * 2;
  });
}

// A net of random control points: folds, peaks and all.
inline BSplineSurface wild_surface(unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> number(-50, 50);
  BSplineSurface s{
      {0, 0, 0, 0, 0.1, 0.35, 0.35, 0.8, 1, 1, 1, 1}, geometry::uniform_clamped_knots(3), {}, {}, {}};
  for (Eigen::MatrixXd* net : {&s.x, &s.y, &s.z})
    *net = Eigen::MatrixXd::NullaryExpr(8, 6, [&] { return number(random); });
  return s;
}

inline BSplineSurface moved(const RigidMotion& motion, BSplineSurface s) {
  for (Eigen::Index i = 0; i < s.x.size(); ++i) {
    const Vector3d p = motion * Vector3d(s.x.data()[i], s.y.data()[i], s.z.data()[i]);
    s.x.data()[i] = p.x(), s.y.data()[i] = p.y(), s.z.data()[i] = p.z();
  }
  return s;
}

// A turn by `degrees` about an axis through `centre`, then a shift.
inline RigidMotion motion_about(const Vector3d& centre, double degrees, const Vector3d& axis,
                                const Vector3d& shift) {
  RigidMotion motion = RigidMotion::Identity();
  motion.linear() = Eigen::AngleAxisd(degrees * M_PI / 180, axis.normalized()).toRotationMatrix();
  motion.translation() = centre + shift - motion.linear() * centre;
  return motion;
}

// The definition of the basis (thesis eq. 2.45) and its derivative, with 64 bits of mantissa where there are.
inline long double slow_basis(const std::vector<double>& knots, int i, int p, long double t) {
  if (p == 0) {
    const bool last = t == knots.back() && knots[i + 1] == knots.back() && knots[i] < knots[i + 1];
    return (knots[i] <= t && t < knots[i + 1]) || last ? 1 : 0;
  }
  long double sum = 0;
  if (knots[i + p] > knots[i])
    sum +=
        (t - knots[i]) / (static_cast<long double>(knots[i + p]) - knots[i]) * slow_basis(knots, i, p - 1, t);
  if (knots[i + p + 1] > knots[i + 1])
    sum += (knots[i + p + 1] - t) / (static_cast<long double>(knots[i + p + 1]) - knots[i + 1]) *
           slow_basis(knots, i + 1, p - 1, t);
  return sum;
}
inline long double slow_slope(const std::vector<double>& knots, int i, long double t) {
  long double sum = 0;
  if (knots[i + 3] > knots[i])
    sum += 3 / (static_cast<long double>(knots[i + 3]) - knots[i]) * slow_basis(knots, i, 2, t);
  if (knots[i + 4] > knots[i + 1])
    sum -= 3 / (static_cast<long double>(knots[i + 4]) - knots[i + 1]) * slow_basis(knots, i + 1, 2, t);
  return sum;
}

struct SlowPoint {
  long double value[3]{}, du[3]{}, dv[3]{};
};
inline SlowPoint slow_point(const BSplineSurface& s, double u, double v) {
  SlowPoint point;
  for (int i = 0; i < s.control_u(); ++i) {
    const long double nu = slow_basis(s.knots_u, i, 3, u), su = slow_slope(s.knots_u, i, u);
    if (nu == 0 && su == 0) continue;
    for (int j = 0; j < s.control_v(); ++j) {
      const long double nv = slow_basis(s.knots_v, j, 3, v), sv = slow_slope(s.knots_v, j, v);
      const double p[3] = {s.x(i, j), s.y(i, j), s.z(i, j)};
      for (int axis = 0; axis < 3; ++axis) {
        point.value[axis] += nu * nv * p[axis];
        point.du[axis] += su * nv * p[axis];
        point.dv[axis] += nu * sv * p[axis];
      }
    }
  }
  return point;
}

// How far (mm) p - r(u, v) is from standing upright on the surface: the larger of its parts along
// r_u and r_v.
inline double off_orthogonal(const BSplineSurface& s, const Vector3d& p, double u, double v) {
  const SlowPoint r = slow_point(s, u, v);
  long double gu = 0, gv = 0, a = 0, c = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const long double offset = p[axis] - r.value[axis];
    gu += offset * r.du[axis], gv += offset * r.dv[axis];
    a += r.du[axis] * r.du[axis], c += r.dv[axis] * r.dv[axis];
  }
  return static_cast<double>(std::max(std::abs(gu) / std::sqrt(a), std::abs(gv) / std::sqrt(c)));
}

}  // namespace moldloft::test
