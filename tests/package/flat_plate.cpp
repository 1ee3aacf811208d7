// What the installed library promises to somebody who has read its headers only: a plane that was measured on a
// square plate comes back as that plane.
#include "geometry/edges/outline.hpp"
#include "geometry/fit/plan_map.hpp"
#include "geometry/fit/surface_fit.hpp"

#include <cmath>
#include <cstdio>
#include <vector>

using namespace moldloft::geometry;

namespace {

constexpr double side_mm = 100;
double plane(double x, double y) { return 3 + 0.1 * x - 0.2 * y; }

Outline square() {
  Outline outline;
  outline.corners = {Eigen::Vector2d{0, 0}, {side_mm, 0}, {side_mm, side_mm}, {0, side_mm}};
  for (std::size_t k = 0; k < 4; ++k) {
    PlanCurve& side = outline.sides[k];
    side.knots = uniform_clamped_knots(4);
    for (int i = 0; i < 7; ++i) {
      const double along = greville(side.knots, i);
      side.control.push_back((1 - along) * outline.corners[k] + along * outline.corners[(k + 1) % 4]);
    }
  }
  return outline;
}

}  // namespace

int main() {
  const PlanMap map{square()};
  std::vector<Eigen::Vector3d> points;
  for (int i = 0; i <= 40; ++i) {
    for (int j = 0; j <= 40; ++j) {
      const double x = side_mm * i / 40, y = side_mm * j / 40;
      points.push_back({x, y, plane(x, y)});
    }
  }
  SurfaceFit fit{{.max_spans_u = 8, .max_spans_v = 8, .max_shots = 1, .shot_sigma_mm = 0}};
  fit.begin(map);
  if (const auto added = fit.add(points, 1.0, 0); !added) return 1;
  fit.start_solving();
  for (;;) {
    const auto ready = fit.step();
    if (!ready) {
      std::printf("no surface: %s\n", to_string(ready.error()).data());
      return 1;
    }
    if (*ready) break;
  }
  const Eigen::Vector3d p = fit.surface().at(0.3, 0.7).value;
  const double error = std::abs(p.z() - plane(p.x(), p.y()));
  std::printf("off by %.1e mm\n", error);
  return error < 1e-9 ? 0 : 1;
}
