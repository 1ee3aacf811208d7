// A measured part as a plate: a triangle mesh whose surface is explicit once it lies flat.
//
// The mesh is repaired into one sheet (mesh_repair.hpp) and laid flat (mesh_flat.hpp). The outline is the mesh's border
// in plan that encloses most; holes inside it are bridged by the nearest triangle's plane. Between vertices the
// surface is linear. The plate's remarks() say its size and what was repaired.
//
// Cost         loading linear, a million triangles 2 s; a sample about 20 ns: a plan grid names the few triangles that
//              may hold the point
// Allocation   at construction only
// Failure      as read_mesh_file(), repair() and make_explicit(); a size that speaks for another unit; numbers of
//              too few digits
#pragma once

#include "host_sim/meshes/length_unit.hpp"
#include "host_sim/meshes/mesh_file.hpp"
#include "host_sim/meshes/mesh_repair.hpp"
#include "host_sim/plates/plate.hpp"

#include <expected>
#include <span>
#include <string>

namespace moldloft::host_sim {

std::expected<std::shared_ptr<const Plate>, SimError> read_mesh_plate(const std::string& path, LengthUnit,
                                                                      double thickness_mm);

// `name` stands in messages; `remarks` of the file are said with the plate's own. The mesh in mm.
std::expected<std::shared_ptr<const Plate>, SimError> make_mesh_plate(
    const std::string& name, const TriangleMesh&, double thickness_mm,
    std::span<const std::string> remarks = {});

}  // namespace moldloft::host_sim
