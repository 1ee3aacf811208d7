// Text as HTML and SVG take it.
//
// Thread       any; pure
// Allocation   yes
#pragma once

#include <string>
#include <string_view>

namespace moldloft::firmware_like {

// Text for HTML and SVG, between tags and in quotes: printable, with & < > " written as entities. What stands there may
// come from a file's name, a device or a person.
std::string escaped(std::string_view text);

}  // namespace moldloft::firmware_like
