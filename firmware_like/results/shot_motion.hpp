// Why shots do not agree: models of it, each linear in at most six unknowns, fitted to how far every edge lies from the
// outline and every sample from the surface.
//
//   moved    from one shot on the plate lies elsewhere: shift and turn in plan, lift and tilt; every shot is tried
//   drift    shift and turn, lift and tilt grow from shot to shot
//   mount    every shot is shifted, turned and tilted alike in the scanner's own frame
//   scale    every shot is too large or too small, about the scanner's own origin
//
// Outline and surface are made of the same shots and have taken in a part of either, so a figure is good to some tenths
// of itself. What is asked is which model explains most.
//
// Frame        world, mm and rad; of the mount the scanner's
// Cost         0.1 ms a shot
#pragma once

#include "firmware_like/results/shot_agreement.hpp"
#include "geometry/fit/plan_map.hpp"
#include "geometry/splines/bspline.hpp"
#include "tasks/cell/shot_evidence.hpp"

#include <Eigen/Core>

#include <cstddef>
#include <cstdint>
#include <vector>

namespace moldloft::firmware_like {

enum class Cause : std::uint8_t { moved, drift, mount, scale };

struct Motion {
  Cause cause{};
  double explained = 0;  // share of the squared disagreement that is not chance
  // Its place in the evidence. moved: the first shot after it; mount: 0, or the shot from which on a plate that was
  // moved would look just so.
  std::size_t shot = 0;
  Eigen::Vector2d shift_mm{0, 0};  // in plan, of the plate's middle; of the mount in the scanner's x and y
  double turn_rad = 0;
  double lift_mm = 0;  // of the plate's middle
  Eigen::Vector2d tilt_rad{0, 0};
  double scale = 0;  // what lengths have too much, as a share of themselves
};

struct Expected {  // standard deviations of what is compared when all is well
  double edge_mm = 0.1, height_mm = 0.06;
};

// The model that explains most; of two that explain about as much the mount, which needs no chance.
Motion best_motion(const tasks::RunEvidence&, const std::vector<SeenEdge>&, const geometry::PlanMap&,
                   const geometry::BSplineSurface&, const Expected&);

}  // namespace moldloft::firmware_like
