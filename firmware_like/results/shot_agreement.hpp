// How each shot agrees with the result that all of them made: its points with the surface in height, the edges that it
// saw with the outline.
//
// Frame        world, mm
// Cost         about 10 microseconds a shot's edge, 1 a shot's sample
#pragma once

#include "firmware_like/results/outline_trace.hpp"
#include "geometry/fit/plan_map.hpp"
#include "geometry/splines/bspline.hpp"
#include "tasks/cell/shot_evidence.hpp"

#include <Eigen/Core>

#include <cstdint>
#include <vector>

namespace moldloft::firmware_like {

struct SeenEdge {
  std::size_t shot = 0;  // its place in the evidence
  Eigen::Vector2d point{0, 0};
  OutlineTrace::Place place;
};

struct ShotAgreement {
  std::size_t shot = 0;
  int samples = 0;
  double height_mm = 0;   // mean of its samples above the surface
  double scatter_mm = 0;  // of its samples about that mean, rms
  int edges = 0;          // on the side of which the next two tell
  double aside_mm =
      0;  // the median distance of its edges outside the outline, of the side where that is largest
  Eigen::Vector2d aside_at{0, 0};
};

// Edges that are farther from the outline than `reach_mm` or nearer to a corner than 5 mm are left out.
std::vector<SeenEdge> seen_edges(const tasks::RunEvidence&, const OutlineTrace&, double reach_mm);

std::vector<ShotAgreement> agreement_of_shots(const tasks::RunEvidence&, const std::vector<SeenEdge>&,
                                              const geometry::PlanMap&, const geometry::BSplineSurface&);

}  // namespace moldloft::firmware_like
