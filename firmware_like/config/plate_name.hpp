// The plate's name and the operator's remark, as they go into every file of a run.
//
// A name is one line of UTF-8. Quotes and slashes are letters like others: a name is never used as a path.
// Control characters, other encodings, blank and overlong texts are refused, because CAD files, pages and the
// journal would show something other than what was typed.
//
// Failure      what is wrong with the text and what is allowed, without the text itself
#pragma once

#include <expected>
#include <filesystem>
#include <string>
#include <string_view>

namespace moldloft::firmware_like {

constexpr std::size_t longest_plate_name = 100;  // characters; ISO 10303-21 readers take 256 in a label
constexpr std::size_t longest_remark = 240;

// The text without blanks at its ends, or why it cannot stand. `what` begins the refusal: "--plate".
std::expected<std::string, std::string> one_line(std::string_view text, std::string_view what,
                                                 std::size_t longest);

// Where a text stops being UTF-8; npos when it never does.
std::size_t first_byte_not_utf8(std::string_view text);

// The default name of a plate: its folder's name, with '?' for characters that a name cannot have.
std::string name_of_folder(const std::filesystem::path&);

}  // namespace moldloft::firmware_like
