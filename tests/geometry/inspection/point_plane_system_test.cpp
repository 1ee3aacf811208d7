#include "geometry/inspection/point_plane_system.hpp"

#include "geometry/inspection/known_surfaces.hpp"

#include <doctest/doctest.h>

using namespace moldloft::geometry;
using namespace moldloft::test;

TEST_CASE(
    "the gradient of the point-to-plane sums is half the slope of their sum of squares, plain and robust") {
  const BSplineSurface design = yard_plate();
  const auto prepared = PreparedSurface::from(design);
  std::mt19937 random(1);
  std::uniform_real_distribution<double> inside(0.1, 0.9), off(-2, 2), weight(0.5, 2);
  std::vector<Vector3d> points;
  std::vector<double> weights;
  for (int i = 0; i < 100; ++i) {
    const SurfacePoint r = design.at(inside(random), inside(random));
    points.push_back(r.value + off(random) * r.normal());
    weights.push_back(weight(random));
  }
  PointPlaneSystem system(*prepared, points, weights);
  const Vector3d centre = system.moments().centroid;
  for (const double tukey_mm : {0.0, 1.5}) {
    const PointPlaneSums here = system.pass(RigidMotion::Identity(), tukey_mm);
    for (int k = 0; k < 6; ++k) {
      const double h = 1e-4;
      const Vector3d axis = Vector3d::Unit(k % 3);
      double sums[2];
      for (int side = 0; side < 2; ++side) {
        const double step = side == 0 ? h : -h;
        const double degrees = step / system.moments().radius * 180 / M_PI;
        const RigidMotion moved_by = k < 3 ? motion_about(centre, 0, axis, step * axis)
                                           : motion_about(centre, degrees, axis, {0, 0, 0});
        sums[side] = system.pass(moved_by, tukey_mm).square;
      }
      // A difference over 2 h: rounding 1e-15 * 300 / h, and the third derivative of the biweight times h^2.
      CHECK(std::abs(here.gradient[k] - (sums[0] - sums[1]) / (4 * h)) < 1e-4);
      CHECK(std::abs(here.gradient[k]) > 1e-2);
    }
  }
}
