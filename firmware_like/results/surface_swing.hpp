// Where a surface goes its own way: between the points that it was fitted to, or beyond them.
//
// Looked at along the outline and in the parts that nobody saw. What is expected there is the nearest point seen,
// continued along the surface's own slope at that point; how much the plate may bend on the way is taken from how much
// it bends where it was seen.
//
// Frame        world, mm
// Cost         some milliseconds
#pragma once

#include "firmware_like/results/outline_trace.hpp"
#include "firmware_like/results/sight_map.hpp"
#include "geometry/fit/plan_map.hpp"
#include "geometry/splines/bspline.hpp"
#include "tasks/cell/shot_evidence.hpp"

#include <Eigen/Core>

#include <vector>

namespace moldloft::firmware_like {

struct SurfaceSwing {
  Eigen::Vector2d place{0, 0};
  double height_mm = 0;       // of the surface over what is expected
  double from_points_mm = 0;  // how far the nearest point is
};

// The largest first, one for each stretch of 50 mm: where the surface is farther off than `limit_mm` and what the
// plate's bend allows besides.
std::vector<SurfaceSwing> surface_swings(const OutlineTrace&, const std::vector<UnseenPart>&,
                                         const tasks::RunEvidence&, const geometry::PlanMap&,
                                         const geometry::BSplineSurface&, double limit_mm);

}  // namespace moldloft::firmware_like
