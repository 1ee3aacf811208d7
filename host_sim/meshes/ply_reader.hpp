// Reads a surface from the bytes of a PLY file, ascii or binary of either byte order. It takes numbers and
// lists of every type, faces of any number of corners, triangle strips, and elements in any order. All else
// in the file is passed over.
//
// Unit         the file's own
// Cost         linear; memory follows the bytes that are there, never the counts that the header announces
// Failure      one line with file, line (ascii) or byte (binary), what is wrong and what to do
#pragma once

#include "host_sim/base/sim_error.hpp"
#include "host_sim/meshes/triangle_mesh.hpp"

#include <expected>
#include <string>
#include <string_view>

namespace moldloft::host_sim {

// The word "ply" on a line of its own, in any case.
bool begins_as_ply(std::string_view bytes);

// `name` stands in messages.
std::expected<MeshFile, SimError> read_ply(const std::string& name, std::string_view bytes);

}  // namespace moldloft::host_sim
