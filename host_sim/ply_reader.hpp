// Reads a triangle mesh from a PLY file: ascii or binary little-endian, coordinates as float or double, faces
// with any number of corners (cut into fans).
//
// Unit         the file's own; mesh_plate.hpp scales
// Failure      one line with the file's name: it cannot be read, is not a PLY, is in a form not known, ends too early,
//              has no faces, names a vertex that is not there, holds a coordinate that is not a number
#pragma once

#include <Eigen/Core>
#include <array>
#include <expected>
#include <string>
#include <vector>

#include "host_sim/sim_error.hpp"

namespace moldloft::host_sim {

struct TriangleMesh {
  std::vector<Eigen::Vector3d> vertices;
  std::vector<std::array<int, 3>> triangles;
};

std::expected<TriangleMesh, SimError> read_ply(const std::string& path);

// Vertices at exactly the same place become one; triangles that lose a corner are dropped.
TriangleMesh welded(const TriangleMesh&);

}  // namespace moldloft::host_sim
