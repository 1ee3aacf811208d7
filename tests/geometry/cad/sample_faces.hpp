// Faces to write, trimmed and not, whose shapes follow from formulas.
#pragma once

#include "geometry/fit/plan_map.hpp"
#include "geometry/outline_shapes.hpp"
#include "geometry/splines/trimmed_surface.hpp"

#include <cmath>
#include <functional>
#include <numbers>

namespace moldloft::test {

using Height = std::function<double(double, double)>;

// x and y of the plan map, z the height at the control points' own plan positions.
inline geometry::BSplineSurface surface_over(const geometry::Outline& outline, int spans_u, int spans_v,
                                             const Height& height) {
  geometry::BSplineSurface s;
  s.knots_u = geometry::uniform_clamped_knots(spans_u);
  s.knots_v = geometry::uniform_clamped_knots(spans_v);
  geometry::PlanMap(outline).to_net(s);
  s.z.resize(s.x.rows(), s.x.cols());
  for (int i = 0; i < s.control_u(); ++i) {
    for (int j = 0; j < s.control_v(); ++j) s.z(i, j) = height(s.x(i, j), s.y(i, j));
  }
  return s;
}

inline double wavy(double x, double y) {
  return 150 + 12 * std::sin(x / 55) * std::cos(y / 70) + 1e-4 * x * y;
}

inline geometry::BSplineSurface bent_plate() { return surface_over(bent_outline(), 8, 12, wavy); }

// Uneven knots, one of them double (C1 there), on a domain that is not the unit square.
inline geometry::BSplineSurface uneven_plate() {
  geometry::BSplineSurface s;
  s.knots_u = {-1, -1, -1, -1, -0.7, 0.1, 0.1, 1.0 / 3, 2, 2, 2, 2};
  s.knots_v = {0, 0, 0, 0, 0.3, 5, 5, 5, 5};
  for (auto* net : {&s.x, &s.y, &s.z}) net->resize(8, 5);
  for (int i = 0; i < 8; ++i) {
    for (int j = 0; j < 5; ++j) {
      s.x(i, j) = 100 * geometry::greville(s.knots_u, i) + 3 * std::sin(j + 0.3 * i);
      s.y(i, j) = 60 * geometry::greville(s.knots_v, j) + 4 * std::cos(0.7 * i);
      s.z(i, j) = -20 + 6 * std::sin(1.3 * i + 0.4) * std::cos(0.9 * j) + 1.0 / (3 + i + j);
    }
  }
  return s;
}

// An ellipse in (u, v) to 1e-5 of its size, as one closed C1 curve.
inline geometry::PlanCurve ellipse(const Eigen::Vector2d& centre, double a, double b, bool clockwise,
                                   int pieces = 16) {
  std::vector<double> parameter;
  std::vector<Eigen::Vector2d> value, slope;
  for (int k = 0; k <= pieces; ++k) {
    const double sign = clockwise ? -1 : 1, angle = sign * 2 * std::numbers::pi * k / pieces;
    parameter.push_back(static_cast<double>(k) / pieces);
    value.push_back(centre + Eigen::Vector2d(a * std::cos(angle), b * std::sin(angle)));
    slope.push_back(sign * 2 * std::numbers::pi * Eigen::Vector2d(-a * std::sin(angle), b * std::cos(angle)));
  }
  value.back() = value.front();
  return {geometry::hermite_knots(parameter), geometry::hermite_control(parameter, value, slope)};
}

// From a to b, bulging to the right of the way by `bulge`.
inline geometry::PlanCurve bow(const Eigen::Vector2d& a, const Eigen::Vector2d& b, double bulge) {
  const Eigen::Vector2d d = b - a, right = Eigen::Vector2d(d.y(), -d.x()).normalized();
  return {geometry::uniform_clamped_knots(1),
          {a, a + d / 3 + bulge * right, a + 2 * d / 3 + bulge * right, b}};
}

// The bent plate cut to a shape of three bows, with an elliptic hole and a hole of two bows, one of which is
// stored the other way round.
inline geometry::TrimmedSurface trimmed_plate() {
  const Eigen::Vector2d a(0.1, 0.15), b(0.9, 0.2), c(0.45, 0.92), d(0.4, 0.6), e(0.55, 0.62);
  geometry::TrimmedSurface face{.surface = bent_plate()};
  face.outer = {
      {.path = bow(a, b, 0.05)}, {.path = bow(c, b, -0.04), .reversed = true}, {.path = bow(c, a, 0.06)}};
  face.holes = {{{.path = ellipse({0.45, 0.35}, 0.12, 0.08, true)}},
                {{.path = bow(d, e, -0.05)}, {.path = bow(d, e, 0.05), .reversed = true}}};
  return face;
}

}  // namespace moldloft::test
