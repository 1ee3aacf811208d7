// Opens a mesh file and reads it by what it holds, not by its name: PLY or STL. A byte-order mark is passed over, and
// text of 16-bit characters, as some shells write it, is read as such.
//
// Failure      one line with the file and what to do: it is not there, may not be read, is a folder, a pipe, a device,
//              empty, too large, compressed, or of another kind; and as the readers
#pragma once

#include "host_sim/meshes/ply_reader.hpp"
#include "host_sim/meshes/stl_reader.hpp"

namespace moldloft::host_sim {

constexpr std::size_t most_mesh_bytes = std::size_t{4} << 30;

std::expected<MeshFile, SimError> read_mesh_file(const std::string& path);

}  // namespace moldloft::host_sim
