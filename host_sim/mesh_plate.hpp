// A measured part as a plate: a triangle mesh whose surface is explicit once it lies flat.
//
// The mesh is welded, turned so that its best-fit plane is horizontal, its normals point up and its long side lies
// along x, and moved so that the middle of its bounding box is the origin. The outline is the mesh's longest boundary
// loop in plan; holes inside it are bridged by the nearest triangle's plane. Between vertices the surface is linear.
//
// Cost         a sample about 20 ns: a plan grid names the few triangles that may hold the point
// Allocation   at construction only
// Failure      as read_ply(), and "not explicit" when more than 1 % of the area faces down once the plate lies flat
#pragma once

#include <expected>
#include <string>

#include "host_sim/plate.hpp"
#include "host_sim/ply_reader.hpp"

namespace moldloft::host_sim {

enum class LengthUnit { millimetre, metre };

std::expected<std::shared_ptr<const Plate>, SimError> read_mesh_plate(const std::string& path, LengthUnit,
                                                                      double thickness_mm);

// `name` stands in messages. The mesh in mm.
std::expected<std::shared_ptr<const Plate>, SimError> make_mesh_plate(const std::string& name,
                                                                      const TriangleMesh&,
                                                                      double thickness_mm);

}  // namespace moldloft::host_sim
