// Outlines that are not what a cell is told to expect: what a torch, a shear or a press leaves of four straight sides.
//
// Each takes the corners of a convex outline, counter-clockwise, and returns the polygon that is left, also
// counter-clockwise. Depths go inwards, square to the side. mm
//
// Thread       any; pure
#pragma once

#include "host_sim/base/plan_polygon.hpp"
#include "host_sim/base/random.hpp"

namespace moldloft::host_sim {

using Outline = std::vector<Eigen::Vector2d>;

// A rectangular notch in one side; `middle` of it as a share of the side's length.
Outline notched(PlanPoints corners, std::size_t side, double middle, double width_mm, double depth_mm);
// The second half of a side lies deeper than the first.
Outline stepped(PlanPoints corners, std::size_t side, double depth_mm);
// A corner is sheared off, so much along both of its sides.
Outline corner_cut(PlanPoints corners, std::size_t corner, double length_mm);
// All corners are arcs that touch their sides.
Outline rounded(PlanPoints corners, double radius_mm);
// Each side is a row of arcs `depth_mm` deep.
Outline scalloped(PlanPoints corners, double pitch_mm, double depth_mm);
// Each side is a row of teeth of random depth.
Outline ragged(PlanPoints corners, double pitch_mm, double depth_mm, Random&);
// So many corners on a circle.
Outline regular(std::size_t corners, double radius_mm);

}  // namespace moldloft::host_sim
