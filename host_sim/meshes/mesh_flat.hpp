// Lays a sheet flat and makes it explicit, z over x and y, with an outline in plan.
//
// Unit         mm
// Cost         linear
// Failure      one line: a closed surface, one that folds back over itself
#pragma once

#include "host_sim/base/sim_error.hpp"
#include "host_sim/meshes/triangle_mesh.hpp"

#include <Eigen/Core>

#include <expected>
#include <string>
#include <vector>

namespace moldloft::host_sim {

// Turns the mesh so that its best-fit plane is horizontal, its normals point up and its long side lies along
// x. Then moves the middle of its bounding box to the origin in plan.
void lay_flat(TriangleMesh&);

struct FlatSheet {
  std::vector<Eigen::Vector2d> outline;  // counter-clockwise, the border that encloses most
  int folds = 0;                         // faces that looked down or stood on edge at the border, left out
  double folds_share = 0;                // of the area in plan
  int holes = 0;                         // other borders that enclose an area: they will be bridged
  double largest_hole_mm2 = 0;
};

// Leaves only faces that look up in the mesh. `name` stands in messages.
std::expected<FlatSheet, SimError> make_explicit(const std::string& name, TriangleMesh&);

}  // namespace moldloft::host_sim
