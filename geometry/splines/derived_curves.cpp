#include "geometry/splines/derived_curves.hpp"

#include <algorithm>
#include <cassert>

namespace moldloft::geometry {

namespace {

std::vector<double> without_ends(const std::vector<double>& knots) {
  return {knots.begin() + 1, knots.end() - 1};
}

// What the difference of control points i and i + 1 is multiplied by.
double slope(const std::vector<double>& knots, int degree, int i) {
  return degree / (knots[i + degree + 1] - knots[i + 1]);
}

// The basis across a line, derivative of order `across`, and the first control point that it belongs to.
struct Across {
  std::vector<double> weights;
  int first;
};

Across basis_across(const std::vector<double>& knots, int degree, double t, int across) {
  t = std::clamp(t, knots.front(), knots.back());
  const int k = find_span(knots, t, degree), width = degree + 1;
  std::vector<double> all(static_cast<std::size_t>((across + 1) * width));
  basis_derivatives(knots, degree, k, t, across, all);
  return {{all.end() - width, all.end()}, k - degree};
}

}  // namespace

template <int dim>
BSplineCurve<dim> derivative(const BSplineCurve<dim>& curve) {
  assert(curve.degree >= 1);
  BSplineCurve<dim> first{without_ends(curve.knots), {}, curve.degree - 1};
  for (std::size_t i = 0; i + 1 < curve.control.size(); ++i) {
    const double factor = slope(curve.knots, curve.degree, static_cast<int>(i));
    first.control.push_back(factor * (curve.control[i + 1] - curve.control[i]));
  }
  return first;
}
template BSplineCurve<1> derivative(const BSplineCurve<1>&);
template BSplineCurve<2> derivative(const BSplineCurve<2>&);
template BSplineCurve<3> derivative(const BSplineCurve<3>&);

BSplineSurface derivative_u(const BSplineSurface& surface) {
  assert(surface.degree_u >= 1);
  const Eigen::Index n = surface.x.rows() - 1;
  Eigen::VectorXd factor(n);
  for (int i = 0; i < n; ++i) factor[i] = slope(surface.knots_u, surface.degree_u, i);
  const auto differences = [&](const Eigen::MatrixXd& net) -> Eigen::MatrixXd {
    return factor.asDiagonal() * (net.bottomRows(n) - net.topRows(n));
  };
  return {without_ends(surface.knots_u), surface.knots_v,      differences(surface.x), differences(surface.y),
          differences(surface.z),        surface.degree_u - 1, surface.degree_v};
}

BSplineSurface derivative_v(const BSplineSurface& surface) {
  assert(surface.degree_v >= 1);
  const Eigen::Index n = surface.x.cols() - 1;
  Eigen::VectorXd factor(n);
  for (int j = 0; j < n; ++j) factor[j] = slope(surface.knots_v, surface.degree_v, j);
  const auto differences = [&](const Eigen::MatrixXd& net) -> Eigen::MatrixXd {
    return (net.rightCols(n) - net.leftCols(n)) * factor.asDiagonal();
  };
  return {surface.knots_u,        without_ends(surface.knots_v), differences(surface.x),
          differences(surface.y), differences(surface.z),        surface.degree_u,
          surface.degree_v - 1};
}

SpaceCurve line_along_u(const BSplineSurface& surface, double v, int across) {
  const Across basis = basis_across(surface.knots_v, surface.degree_v, v, across);
  SpaceCurve line{surface.knots_u, {}, surface.degree_u};
  for (int i = 0; i < surface.control_u(); ++i) {
    Eigen::Vector3d point = Eigen::Vector3d::Zero();
    for (int j = 0; j <= surface.degree_v; ++j) {
      const int c = basis.first + j;
      point += basis.weights[j] * Eigen::Vector3d(surface.x(i, c), surface.y(i, c), surface.z(i, c));
    }
    line.control.push_back(point);
  }
  return line;
}

SpaceCurve line_along_v(const BSplineSurface& surface, double u, int across) {
  const Across basis = basis_across(surface.knots_u, surface.degree_u, u, across);
  SpaceCurve line{surface.knots_v, {}, surface.degree_v};
  for (int j = 0; j < surface.control_v(); ++j) {
    Eigen::Vector3d point = Eigen::Vector3d::Zero();
    for (int i = 0; i <= surface.degree_u; ++i) {
      const int r = basis.first + i;
      point += basis.weights[i] * Eigen::Vector3d(surface.x(r, j), surface.y(r, j), surface.z(r, j));
    }
    line.control.push_back(point);
  }
  return line;
}

}  // namespace moldloft::geometry
