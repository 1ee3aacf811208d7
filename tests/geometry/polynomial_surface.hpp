// A bicubic polynomial map of the unit square as a B-spline surface, exactly, over any knots: for tests whose
// truth is the polynomial.
#pragma once

#include "geometry/splines/bspline.hpp"

#include <Eigen/LU>

#include <functional>

namespace moldloft::test {

// `map` must be a polynomial of degree 3 at most in u and in v.
inline geometry::BSplineSurface polynomial_surface(const std::function<Eigen::Vector3d(double, double)>& map,
                                                   std::vector<double> knots_u, std::vector<double> knots_v) {
  const std::vector<double> bezier{0, 0, 0, 0, 1, 1, 1, 1};
  Eigen::Matrix4d basis;  // Bernstein values at the nodes 0, 1/3, 2/3, 1
  for (int i = 0; i < 4; ++i) {
    const auto values = geometry::cubic_basis(bezier, 3, i / 3.0).value;
    for (int j = 0; j < 4; ++j) basis(i, j) = values[j];
  }
  const Eigen::Matrix4d inverse = basis.inverse();
  geometry::BSplineSurface surface{std::move(knots_u), std::move(knots_v), {}, {}, {}};
  const int nu = static_cast<int>(surface.knots_u.size()) - 4,
            nv = static_cast<int>(surface.knots_v.size()) - 4;
  Eigen::MatrixXd* nets[3] = {&surface.x, &surface.y, &surface.z};
  for (int axis = 0; axis < 3; ++axis) {
    Eigen::Matrix4d samples;
    for (int i = 0; i < 4; ++i) {
      for (int j = 0; j < 4; ++j) samples(i, j) = map(i / 3.0, j / 3.0)[axis];
    }
    const Eigen::Matrix4d net = inverse * samples * inverse.transpose();
    Eigen::MatrixXd half(nu, 4);
    for (int j = 0; j < 4; ++j) {
      const std::vector<double> column(net.col(j).data(), net.col(j).data() + 4);
      for (int i = 0; i < nu; ++i)
        half(i, j) = geometry::refined_coefficient(bezier, column, surface.knots_u, i);
    }
    nets[axis]->resize(nu, nv);
    for (int i = 0; i < nu; ++i) {
      const Eigen::RowVectorXd row = half.row(i);
      const std::vector<double> along(row.data(), row.data() + 4);
      for (int j = 0; j < nv; ++j)
        (*nets[axis])(i, j) = geometry::refined_coefficient(bezier, along, surface.knots_v, j);
    }
  }
  return surface;
}

// z over x = left + size u, y likewise, of one height function (degree 3 in x and in y).
inline geometry::BSplineSurface height_surface(const std::function<double(double, double)>& z, double from,
                                               double to, int spans = 1) {
  return polynomial_surface(
      [&](double u, double v) {
        const double x = from + (to - from) * u, y = from + (to - from) * v;
        return Eigen::Vector3d(x, y, z(x, y));
      },
      geometry::uniform_clamped_knots(spans), geometry::uniform_clamped_knots(spans));
}

}  // namespace moldloft::test
