// Plates that are not four-sided, measured with noise and fitted over their carriers.
#pragma once

#include "geometry/fit/carrier.hpp"
#include "geometry/fit/surface_fit.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <numbers>
#include <random>
#include <string>
#include <vector>

namespace moldloft::test {

struct OddPlate {
  std::string name;
  std::vector<Eigen::Vector2d> outline;
  double (*height)(double x, double y);
  double sigma_mm;
  double area_mm2;          // of the true surface, closed form
  double steepest;          // slope of the true surface
  double outline_area_mm2;  // what the outline's interpolation may add
};

struct FittedPlate {
  geometry::Carrier carrier;
  geometry::TrimmedSurface face;
  geometry::SurfaceFitReport report;
  std::size_t points = 0;
  double rms_mm = 0, max_mm = 0;  // against the truth, inside the outline
  double noise_mm = 0;  // sigma sqrt(N / M): what is left of the noise in a fit of N unknowns to M points

  // A slope that is off by e changes the area element by less than (slope + e) e. The noise of the
  // fit waves with a span at the shortest: its slope is at most 2 pi / span times its height, in each
  // of two directions.
  double area_bound(const OddPlate& plate) const {
    const auto& c = carrier.outline.corners;
    const double span =
        std::min((c[1] - c[0]).norm() / report.spans_u, (c[3] - c[0]).norm() / report.spans_v);
    const double e = std::sqrt(2.0) * 2 * std::numbers::pi / span * noise_mm;
    return plate.area_mm2 * (plate.steepest + e) * e + plate.outline_area_mm2;
  }
};

inline std::vector<Eigen::Vector2d> regular(int n, double radius, const Eigen::Vector2d& middle,
                                            double turn) {
  std::vector<Eigen::Vector2d> p;
  for (int k = 0; k < n; ++k) {
    const double angle = turn + 2 * std::numbers::pi * k / n;
    p.push_back(middle + radius * Eigen::Vector2d(std::cos(angle), std::sin(angle)));
  }
  return p;
}

constexpr double points_spacing_mm = 0.75;

// A tilted hexagon: a plane z = 0.3 x - 0.2 y + 100 has area F sqrt(1 + 0.3^2 + 0.2^2) over a plan F.
inline OddPlate hexagonal_plate() {
  const double side = 160, plan = 1.5 * std::sqrt(3.0) * side * side;
  return {"hexagon",
          regular(6, side, {400, 250}, 0.17),
          [](double x, double y) { return 100 + 0.3 * x - 0.2 * y; },
          0.05,
          plan * std::sqrt(1 + 0.09 + 0.04),
          std::hypot(0.3, 0.2),
          0};
}

// A dish z = (x^2 + y^2) / (2 p) about its middle, p = 600: area 2 pi / 3 p^2 ((1 + (R/p)^2)^(3/2) - 1).
// The outline's interpolation error is 5/384 h^4 / R^3 (smooth_sides.hpp), times the circumference, times
// the steepest secant.
inline OddPlate round_plate() {
  const double radius = 150, p = 600, pi = std::numbers::pi, h = 2 * pi * radius / 72;
  const double off = 1.1 * 5.0 / 384 * std::pow(h, 4) / std::pow(radius, 3);
  return {"disk",
          regular(72, radius, {-50, 600}, 0),
          [](double x, double y) { return (std::pow(x + 50, 2) + std::pow(y - 600, 2)) / 1200; },
          0.05,
          2 * pi / 3 * p * p * (std::pow(1 + radius * radius / (p * p), 1.5) - 1),
          radius / p,
          off * 2 * pi * radius * std::hypot(1, radius / p)};
}

// Points over the whole rectangle as a scanner sees them, the table 6 mm below the plate included; only those
// inside the outline go into the fit. Shots of one row of points each would be odd, so all are one shot,
// taken as exact.
inline FittedPlate fitted_on_carrier(const OddPlate& plate) {
  auto found = geometry::carrier_of(plate.outline);
  REQUIRE(found.has_value());
  FittedPlate fitted{.carrier = std::move(*found), .face = {}, .report = {}};
  const geometry::PlanMap map(fitted.carrier.outline);
  geometry::SurfaceFit fit({.max_spans_u = 16, .max_spans_v = 16, .max_shots = 1, .shot_sigma_mm = 0});
  fit.begin(map);
  std::mt19937 random(7);
  std::normal_distribution<double> noise(0, plate.sigma_mm);
  const auto& corners = fitted.carrier.outline.corners;
  const int nu = static_cast<int>((corners[1] - corners[0]).norm() / points_spacing_mm),
            nv = static_cast<int>((corners[3] - corners[0]).norm() / points_spacing_mm);
  for (int i = 0; i < nu; ++i) {
    std::vector<Eigen::Vector3d> stripe;
    for (int j = 0; j < nv; ++j) {
      const Eigen::Vector2d xy = map.at((i + 0.5) / nu, (j + 0.5) / nv).value;
      if (!fitted.carrier.inside(xy)) continue;  // the table
      stripe.push_back({xy.x(), xy.y(), plate.height(xy.x(), xy.y()) + noise(random)});
    }
    fitted.points += stripe.size();
    REQUIRE(fit.add(stripe, 1, 0).has_value());
  }
  fit.start_solving();
  for (bool ready = false; !ready;) {
    const auto step = fit.step();
    REQUIRE(step.has_value());
    ready = *step;
  }
  fitted.face = {.surface = fit.surface(), .outer = fitted.carrier.trim};
  fitted.report = fit.report();
  fitted.noise_mm = plate.sigma_mm * std::sqrt(static_cast<double>(fitted.face.surface.x.size()) /
                                               static_cast<double>(fitted.points));
  std::size_t looked = 0;
  for (int i = 0; i <= 150; ++i) {
    for (int j = 0; j <= 150; ++j) {
      const Eigen::Vector3d p = fitted.face.surface.at(i / 150.0, j / 150.0).value;
      if (!fitted.carrier.inside(p.head<2>())) continue;
      const double error = p.z() - plate.height(p.x(), p.y());
      fitted.rms_mm += error * error, fitted.max_mm = std::max(fitted.max_mm, std::abs(error)), ++looked;
    }
  }
  fitted.rms_mm = std::sqrt(fitted.rms_mm / static_cast<double>(looked));
  return fitted;
}

}  // namespace moldloft::test
