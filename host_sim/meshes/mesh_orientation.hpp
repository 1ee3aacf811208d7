// Turns the faces of each connected sheet the same way round.
//
// Sheets are connected across edges that two faces share. In each, the faces that are fewer by area are turned; where
// both ways weigh the same, those unlike the sheet's first face are.
//
// Cost         linear
#pragma once

#include "host_sim/meshes/triangle_mesh.hpp"

#include <optional>
#include <vector>

namespace moldloft::host_sim {

struct Orientation {
  int turned = 0;                            // faces
  std::vector<int> sheet;                    // of each face, from 0
  std::vector<double> area_mm2;              // of each sheet
  std::optional<Eigen::Vector3d> one_sided;  // where a sheet has no two sides: turning faces cannot help
};

Orientation orient(TriangleMesh&, const std::vector<int>& mates);

}  // namespace moldloft::host_sim
