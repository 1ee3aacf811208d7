// Seeded curves, surfaces and knots for the spline tests, and the basis from its definition
// in extended precision.
#pragma once

#include "geometry/splines/bspline.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

namespace moldloft::geometry::samples {

constexpr double eps = std::numeric_limits<double>::epsilon();

// The definition (thesis eq. 2.45), slow and plain: N_i of degree p at t, the last span closed at the right.
inline long double basis(const std::vector<double>& knots, int i, int p, long double t) {
  if (p == 0) {
    const bool at_end = t == knots.back() && knots[i] < knots[i + 1] && knots[i + 1] == knots.back();
    return (knots[i] <= t && t < knots[i + 1]) || at_end ? 1 : 0;
  }
  long double sum = 0;
  if (knots[i + p] > knots[i])
    sum += (t - knots[i]) / (static_cast<long double>(knots[i + p]) - knots[i]) * basis(knots, i, p - 1, t);
  if (knots[i + p + 1] > knots[i + 1]) {
    sum += (knots[i + p + 1] - t) / (static_cast<long double>(knots[i + p + 1]) - knots[i + 1]) *
           basis(knots, i + 1, p - 1, t);
  }
  return sum;
}

// Its m-th derivative by differences of lower degrees, straight from (2.45). `sign` = 1 gives what the
// differences are made of instead: the sum of their absolute values.
inline long double basis_derivative(const std::vector<double>& knots, int i, int p, int m, long double t,
                                    int sign = -1) {
  if (m == 0) return basis(knots, i, p, t);
  if (m > p) return 0;
  const long double left = static_cast<long double>(knots[i + p]) - knots[i];
  const long double right = static_cast<long double>(knots[i + p + 1]) - knots[i + 1];
  long double sum = 0;
  if (left > 0) sum += p / left * basis_derivative(knots, i, p - 1, m - 1, t, sign);
  if (right > 0) sum += sign * p / right * basis_derivative(knots, i + 1, p - 1, m - 1, t, sign);
  return sum;
}

struct Numbers {
  std::mt19937 random{11};
  double in(double low, double high) { return std::uniform_real_distribution<double>(low, high)(random); }
  int of(int low, int high) { return std::uniform_int_distribution<int>(low, high)(random); }

  // Clamped knots on [0, 1] with `interior` uneven interior knots, some of them double where the
  // degree allows it.
  std::vector<double> knots(int degree, int interior) {
    std::vector<double> inner(static_cast<std::size_t>(interior));
    for (double& t : inner) t = in(0.02, 0.98);
    std::ranges::sort(inner);
    for (int i = 1; degree > 1 && i < interior; i += 3) inner[i] = inner[i - 1];
    std::vector<double> knots(static_cast<std::size_t>(degree) + 1, 0.0);
    knots.insert(knots.end(), inner.begin(), inner.end());
    knots.insert(knots.end(), static_cast<std::size_t>(degree) + 1, 1.0);
    return knots;
  }

  template <int dim>
  BSplineCurve<dim> curve(int degree, int interior, double size = 1) {
    BSplineCurve<dim> c{knots(degree, interior), {}, degree};
    c.control.resize(static_cast<std::size_t>(degree + 1 + interior));
    for (auto& p : c.control)
      for (int axis = 0; axis < dim; ++axis) p[axis] = in(-size, size);
    return c;
  }

  BSplineSurface surface(int degree_u, int interior_u, int degree_v, int interior_v, double size = 1) {
    BSplineSurface s{
        knots(degree_u, interior_u), knots(degree_v, interior_v), {}, {}, {}, degree_u, degree_v};
    for (Eigen::MatrixXd* net : {&s.x, &s.y, &s.z}) {
      *net = Eigen::MatrixXd::NullaryExpr(degree_u + 1 + interior_u, degree_v + 1 + interior_v,
                                          [&] { return in(-size, size); });
    }
    return s;
  }
};

// The m-th derivative of a curve's axis at t, from the definition.
template <int dim>
double exact(const BSplineCurve<dim>& c, int axis, long double t, int m = 0) {
  long double sum = 0;
  for (std::size_t i = 0; i < c.control.size(); ++i)
    sum += basis_derivative(c.knots, static_cast<int>(i), c.degree, m, t) * c.control[i][axis];
  return static_cast<double>(sum);
}

inline double exact(const BSplineSurface& s, const Eigen::MatrixXd& net, long double u, long double v,
                    int mu = 0, int mv = 0) {
  std::vector<long double> along_v;
  for (int j = 0; j < s.control_v(); ++j)
    along_v.push_back(basis_derivative(s.knots_v, j, s.degree_v, mv, v));
  long double sum = 0;
  for (int i = 0; i < s.control_u(); ++i) {
    const long double n = basis_derivative(s.knots_u, i, s.degree_u, mu, u);
    for (int j = 0; n != 0 && j < s.control_v(); ++j) sum += n * along_v[j] * net(i, j);
  }
  return static_cast<double>(sum);
}

}  // namespace moldloft::geometry::samples
