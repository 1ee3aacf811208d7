// C++ source as text, as far as the rules of the tree need to understand it.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace moldloft::tree {

std::vector<std::string_view> lines_of(std::string_view text);

// The text with comments blanked out, line ends kept.
std::string without_comments(std::string_view text);
// ... and the contents of string and character literals, too.
std::string code_only(std::string_view text);

struct Include {
  int line = 0;
  bool quoted = false;  // "..." rather than <...>
  std::string name;
};
std::vector<Include> includes_of(std::string_view text);

// How many characters wide a line of UTF-8 is.
std::size_t width_of(std::string_view line);

}  // namespace moldloft::tree
