#include "geometry/splines/bspline.hpp"

#include <algorithm>
#include <cassert>

namespace moldloft::geometry {

std::vector<double> uniform_clamped_knots(int spans) {
  assert(spans >= 1);
  std::vector<double> knots(spans + 1 + 2 * cubic, 0.0);
  for (int i = 0; i <= spans; ++i) knots[cubic + i] = static_cast<double>(i) / spans;
  std::fill(knots.end() - cubic, knots.end(), 1.0);
  return knots;
}

int find_span(std::span<const double> knots, double t) {
  const int last = static_cast<int>(knots.size()) - cubic - 2;
  if (!(t > knots[cubic])) return cubic;
  if (t >= knots[last + 1]) {  // the last span that is not empty
    int k = last;
    while (k > cubic && knots[k] >= knots[k + 1]) --k;
    return k;
  }
  const auto first = knots.begin() + cubic;
  return static_cast<int>(std::upper_bound(first, knots.begin() + last + 1, t) - knots.begin()) - 1;
}

BasisValues cubic_basis(std::span<const double> knots, int k, double t) {
  // The recurrence raises the degree once a row: every entry is a sum of nonnegative terms inside the span,
  // so nothing cancels. The rows of degree 1 and 2 give the derivatives by differences (thesis eq. 2.45).
  const double left1 = t - knots[k], left2 = t - knots[k - 1], left3 = t - knots[k - 2];
  const double right1 = knots[k + 1] - t, right2 = knots[k + 2] - t, right3 = knots[k + 3] - t;

  const double inv1 = 1.0 / (knots[k + 1] - knots[k]);
  const double a0 = right1 * inv1, a1 = left1 * inv1;  // degree 1

  const double inv20 = 1.0 / (knots[k + 1] - knots[k - 1]), inv21 = 1.0 / (knots[k + 2] - knots[k]);
  const double q0 = a0 * inv20, q1 = a1 * inv21;
  const double b0 = right1 * q0, b1 = left2 * q0 + right2 * q1, b2 = left1 * q1;  // degree 2

  const double inv30 = 1.0 / (knots[k + 1] - knots[k - 2]), inv31 = 1.0 / (knots[k + 2] - knots[k - 1]),
               inv32 = 1.0 / (knots[k + 3] - knots[k]);
  const double c0 = b0 * inv30, c1 = b1 * inv31, c2 = b2 * inv32;

  BasisValues basis;
  basis.value = {right1 * c0, left3 * c0 + right2 * c1, left2 * c1 + right3 * c2, left1 * c2};
  basis.first = {-3 * c0, 3 * (c0 - c1), 3 * (c1 - c2), 3 * c2};
  // Second derivatives: the first derivatives of the degree-2 row, differenced once more.
  const double d0 = -2 * q0 * inv30, d1 = 2 * (q0 - q1) * inv31, d2 = 2 * q1 * inv32;
  basis.second = {-3 * d0, 3 * (d0 - d1), 3 * (d1 - d2), 3 * d2};
  return basis;
}

double greville(std::span<const double> knots, int i) {
  return (knots[i + 1] + knots[i + 2] + knots[i + 3]) / 3;
}

double refined_coefficient(std::span<const double> coarse, std::span<const double> coefficients,
                           std::span<const double> fine, int i) {
  // De Boor's triangle with a different argument at every level evaluates the blossom of the piece that lies
  // there.
  const int k = find_span(coarse, 0.5 * (fine[i + 1] + fine[i + 3]));
  std::array<double, 4> d;
  for (int j = 0; j <= cubic; ++j) d[j] = coefficients[k - cubic + j];
  for (int level = 1; level <= cubic; ++level) {
    const double t = fine[i + level];
    for (int j = cubic; j >= level; --j) {
      const double low = coarse[k - cubic + j], high = coarse[k + 1 + j - level];
      const double share = (t - low) / (high - low);
      d[j] = (1 - share) * d[j - 1] + share * d[j];
    }
  }
  return d[cubic];
}

CurvePoint2 PlanCurve::at(double t) const {
  t = std::clamp(t, knots[cubic], knots[knots.size() - cubic - 1]);
  const int k = find_span(knots, t);
  const BasisValues basis = cubic_basis(knots, k, t);
  CurvePoint2 point{Eigen::Vector2d::Zero(), Eigen::Vector2d::Zero(), Eigen::Vector2d::Zero()};
  for (int i = 0; i <= cubic; ++i) {
    const Eigen::Vector2d& p = control[k - cubic + i];
    point.value += basis.value[i] * p;
    point.first += basis.first[i] * p;
    point.second += basis.second[i] * p;
  }
  return point;
}

SurfacePoint BSplineSurface::at(double u, double v) const {
  u = std::clamp(u, knots_u[cubic], knots_u[knots_u.size() - cubic - 1]);
  v = std::clamp(v, knots_v[cubic], knots_v[knots_v.size() - cubic - 1]);
  const int ku = find_span(knots_u, u), kv = find_span(knots_v, v);
  const BasisValues bu = cubic_basis(knots_u, ku, u), bv = cubic_basis(knots_v, kv, v);
  SurfacePoint point;
  const Eigen::MatrixXd* nets[3] = {&x, &y, &z};
  for (int axis = 0; axis < 3; ++axis) {
    double value = 0, du = 0, dv = 0, duu = 0, duv = 0, dvv = 0;
    for (int j = 0; j <= cubic; ++j) {
      double row = 0, row_u = 0, row_uu = 0;
      for (int i = 0; i <= cubic; ++i) {
        const double p = (*nets[axis])(ku - cubic + i, kv - cubic + j);
        row += bu.value[i] * p;
        row_u += bu.first[i] * p;
        row_uu += bu.second[i] * p;
      }
      value += bv.value[j] * row;
      du += bv.value[j] * row_u;
      duu += bv.value[j] * row_uu;
      dv += bv.first[j] * row;
      duv += bv.first[j] * row_u;
      dvv += bv.second[j] * row;
    }
    point.value[axis] = value, point.du[axis] = du, point.dv[axis] = dv;
    point.duu[axis] = duu, point.duv[axis] = duv, point.dvv[axis] = dvv;
  }
  return point;
}

}  // namespace moldloft::geometry
