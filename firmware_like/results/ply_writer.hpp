// PLY files that anyone can read: binary little-endian, the unit in a comment.
#pragma once

#include "firmware_like/results/measured_points.hpp"
#include "geometry/splines/bspline.hpp"

#include <string>
#include <vector>

namespace moldloft::firmware_like {

// The residual stands twice, under the names by which the two viewers most used find what is to be coloured: MeshLab
// takes `quality`, CloudCompare what begins with `scalar_` (and offers shot and stripe as well).
std::string points_ply(const std::vector<MeasuredPoint>&);

// The surface's border as a closed line of vertices and edges, counter-clockwise.
std::string boundary_ply(const geometry::BSplineSurface&, int points_per_side);

}  // namespace moldloft::firmware_like
