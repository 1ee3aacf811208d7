// Outlines as formulas, for tests of what is built on them.
#pragma once

#include "geometry/edges/outline.hpp"

#include <array>
#include <cmath>
#include <random>
#include <vector>

namespace moldloft::test {

inline geometry::Outline straight_outline(const std::array<Eigen::Vector2d, 4>& corners, int spans = 4) {
  geometry::Outline outline;
  outline.corners = corners;
  for (int side = 0; side < 4; ++side) {
    geometry::PlanCurve& curve = outline.sides[side];
    curve.knots = geometry::uniform_clamped_knots(spans);
    for (int i = 0; i < spans + 3; ++i) {
      const double g = geometry::greville(curve.knots, i);
      curve.control.push_back((1 - g) * corners[side] + g * corners[(side + 1) % 4]);
    }
  }
  return outline;
}

// A quadrangle of about 300 mm whose sides bend outwards by 2 to 7 mm.
inline geometry::Outline bent_outline() {
  geometry::Outline outline = straight_outline({Eigen::Vector2d(10, 20), {310, 50}, {290, 340}, {-20, 310}});
  for (int side = 0; side < 4; ++side) {
    std::vector<Eigen::Vector2d>& control = outline.sides[side].control;
    const Eigen::Vector2d d = (control.back() - control.front()).normalized();
    for (std::size_t i = 1; i + 1 < control.size(); ++i) {
      control[i] += (2.0 + side + (i == 2 ? 1.5 : 0.0)) * Eigen::Vector2d(d.y(), -d.x());
    }
  }
  return outline;
}

// What a scanner sees of a closed polygon: a point every 1.4 mm, with noise.
inline std::vector<Eigen::Vector2d> seen(const std::vector<Eigen::Vector2d>& border, double noise = 0.05,
                                         unsigned seed = 1) {
  std::mt19937 random(seed);
  std::normal_distribution<double> off(0, noise);
  std::vector<Eigen::Vector2d> points;
  for (std::size_t i = 0; i < border.size(); ++i) {
    const Eigen::Vector2d a = border[i], d = border[(i + 1) % border.size()] - a;
    const int n = static_cast<int>(std::ceil(d.norm() / 1.4));
    for (int k = 0; k < n; ++k)
      points.push_back(a + (k + 0.5) / n * d + Eigen::Vector2d(off(random), off(random)));
  }
  return points;
}

}  // namespace moldloft::test
