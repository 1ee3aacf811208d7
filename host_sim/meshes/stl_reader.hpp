// Reads a surface from the bytes of an STL file, text or binary. The bytes themselves tell which, since a
// binary one may begin with "solid" too. Several solids of a text are one surface. Normals are passed over:
// the corners' order tells them.
//
// Unit         the file's own; STL names none
// Cost         linear; memory follows the bytes that are there
// Failure      one line with file, line (text) or facet (binary), what is wrong and what to do
#pragma once

#include "host_sim/base/sim_error.hpp"
#include "host_sim/meshes/triangle_mesh.hpp"

#include <expected>
#include <string>
#include <string_view>

namespace moldloft::host_sim {

bool is_binary_stl(std::string_view bytes);
bool begins_as_text_stl(std::string_view bytes);

// `name` stands in messages.
std::expected<MeshFile, SimError> read_binary_stl(const std::string& name, std::string_view bytes);
std::expected<MeshFile, SimError> read_text_stl(const std::string& name, std::string_view bytes);

}  // namespace moldloft::host_sim
