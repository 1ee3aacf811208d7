// The wings inside the rooms: read from the same lines of CMake that build them (moldloft_wing in
// toolchain/rooms.cmake), so that there is one list. Every finding is one line: where, and what to do.
#pragma once

#include "tree/rules.hpp"

#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace moldloft::tree {

struct Wing {
  std::string room, name;
  std::vector<std::string> links;  // names of wings of the same room
};

// The wings that a room's CMakeLists.txt declares, in its order.
std::vector<Wing> wings_in(std::string_view cmake_text);

// Includes of one source file from wings of its own room that its wing does not link, directly or by way of others.
Findings wing_include_findings(std::string_view path, std::string_view text, std::span<const Wing> wings);

// A circle of wings; a link to a wing that is not there; more floors than one can keep in mind.
Findings wing_order_findings(std::span<const Wing> wings);

// Sources that stand in no wing of a room that has wings; folders with more components than one can survey. A component
// is a header and its source, counted once.
Findings wing_content_findings(std::span<const std::string> paths, std::span<const Wing> wings);

}  // namespace moldloft::tree
