// The truth comparison: a measured surface and outline against the plate as it is, in world
// coordinates, nothing aligned.
//
// Normal deviations are taken on a grid of 101 x 101 over the plate's four corners, where a grid point lies
// inside both outlines: the distance along the true surface's normal to the measured surface, positive where
// the measured one lies above. The outline's figure is the Hausdorff distance of the outlines in plan.
//
// Cost         about 50 ms
// Failure      one line: a file that is missing or not what it should be, a surface that nowhere lies over the plate
#pragma once

#include "geometry/splines/bspline.hpp"
#include "host_sim/cell/cell_description.hpp"

#include <array>
#include <expected>
#include <string>
#include <vector>

namespace moldloft::host_sim {

constexpr int judge_grid = 101;

struct Deviation {
  Eigen::Vector2d world;  // mm, plan
  double normal_mm = 0;   // NaN where the point lies outside either outline
};

struct Verdict {
  double normal_max_mm = 0, normal_rms_mm = 0, outline_max_mm = 0, corner_max_mm = 0;
  Eigen::Vector2d normal_max_at{0, 0};  // mm, plan
  int points = 0;                       // of the grid that were compared
  std::vector<Deviation> grid;  // judge_grid rows of judge_grid, for a picture
};

std::expected<Verdict, SimError> judge(const PlateInstance& truth, const geometry::BSplineSurface& measured,
                                       const std::array<Eigen::Vector2d, 4>& measured_corners);

// Judges a run folder: reads surface.json and summary.json (boundary.corners_mm), writes `truth` into summary.json.
std::expected<Verdict, SimError> judge_run(const std::string& folder, const PlateInstance& truth);

}  // namespace moldloft::host_sim
