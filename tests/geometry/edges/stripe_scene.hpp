// A plate under stripes, as a formula: heights of a plate with a convex outline above a table, sampled the
// way a stripe scanner samples, with everything that hurts switched on one by one. The truth is the formula.
#pragma once

#include "geometry/edges/plate_runs.hpp"

#include <Eigen/Core>

#include <functional>
#include <limits>
#include <random>
#include <vector>

namespace moldloft::test {

struct StripeScene {
  std::vector<Eigen::Vector2d> outline;  // counter-clockwise, convex, scanner coordinates
  std::function<double(double, double)> height = [](double, double) { return 0.0; };
  double thickness = 6;
  bool table = true;
  double shadow_mm = 0;  // beyond every edge, along the stripe, nothing is seen for so long
  int wall_points = 0;   // hits on the side wall, taken from the points that would lie beyond
  double noise = 0.051, outliers = 0.002, drop_outs = 0.01;
  int stripes = 100, points = 500;
  double pitch = 1.03, spacing = 0.204;
  double y_phase = 0;  // shift of the sampling along the stripe, mm
  unsigned seed = 1;

  // Where the line x = const meets the outline: lower and upper y; lower > upper where it misses.
  std::pair<double, double> chord(double x) const {
    double low = -1e9, high = 1e9;
    for (std::size_t i = 0; i < outline.size(); ++i) {
      const Eigen::Vector2d a = outline[i], d = outline[(i + 1) % outline.size()] - a;
      // inside: d.x (y - a.y) - d.y (x - a.x) >= 0
      const double offset = d.y() * (x - a.x());
      if (std::abs(d.x()) < 1e-12) {
        if (offset > 0) return {1, -1};
      } else if (d.x() > 0) {
        low = std::max(low, a.y() + offset / d.x());
      } else {
        high = std::min(high, a.y() + offset / d.x());
      }
    }
    return {low, high};
  }
  double x_of(int stripe) const { return (stripe - 0.5 * (stripes - 1)) * pitch; }
};

struct Frame {
  std::vector<std::vector<float>> x, y, z;
  std::vector<geometry::StripeView> views;
};

inline Frame sample(const StripeScene& scene) {
  std::mt19937 random(scene.seed);
  std::normal_distribution<double> noise(0, scene.noise);
  std::uniform_real_distribution<double> uniform(0, 1), far(-8, 8);
  constexpr float missing = std::numeric_limits<float>::quiet_NaN();
  Frame frame;
  for (int s = 0; s < scene.stripes; ++s) {
    const double x = scene.x_of(s);
    const auto [low, high] = scene.chord(x);
    std::vector<float> xs, ys, zs;
    for (int i = 0; i < scene.points; ++i) {
      const double y = (i - 0.5 * (scene.points - 1)) * scene.spacing + scene.y_phase;
      double at_y = y, z = scene.height(x, y);
      bool seen = true;
      if (y < low || y > high) {
        const double edge = y < low ? low : high;
        const bool beside = low <= high;
        const int beyond = static_cast<int>(std::abs(y - edge) / scene.spacing);
        const double top = scene.height(x, edge);
        z = -scene.thickness - 0.5;
        if (beside && beyond < scene.wall_points) {
          at_y = edge;
          z = top - scene.thickness * (beyond + uniform(random)) / scene.wall_points;
        } else {
          seen = scene.table && !(beside && std::abs(y - edge) < scene.shadow_mm);
        }
      }
      z += noise(random);
      if (uniform(random) < scene.outliers) z += far(random);
      if (uniform(random) < scene.drop_outs) seen = false;
      xs.push_back(seen ? static_cast<float>(x) : missing);
      ys.push_back(seen ? static_cast<float>(at_y) : missing);
      zs.push_back(seen ? static_cast<float>(z) : missing);
    }
    frame.x.push_back(std::move(xs)), frame.y.push_back(std::move(ys)), frame.z.push_back(std::move(zs));
  }
  for (int s = 0; s < scene.stripes; ++s) frame.views.push_back({frame.x[s], frame.y[s], frame.z[s]});
  return frame;
}

// A rectangle with its first corner at `corner`, its first side along `angle` (rad).
inline std::vector<Eigen::Vector2d> rectangle(Eigen::Vector2d corner, double angle, double length,
                                              double width) {
  const Eigen::Vector2d a(std::cos(angle), std::sin(angle)), b(-a.y(), a.x());
  return {corner, corner + length * a, corner + length * a + width * b, corner + width * b};
}

}  // namespace moldloft::test
