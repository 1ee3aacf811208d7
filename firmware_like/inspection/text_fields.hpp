// Lines and fields of the lists that other programs print.
//
// Thread       any; pure
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace moldloft::firmware_like {

// Without line ends (LF, CR LF, CR) and without a byte order mark.
std::vector<std::string> lines_of(std::string_view text);

struct Field {
  std::string_view text;
  std::size_t begin = 0, end = 0;  // in the line
};

// Between blanks and tabs; or, where `separator` is given, between those, blanks around taken off, empty ones kept.
std::vector<Field> fields_of(std::string_view line, std::optional<char> separator = {});

// A whole, finite number with a decimal point or, where allowed, a decimal comma; a sign of either kind may lead,
// and the power may be Fortran's (1.5D+01).
std::optional<double> number_of(std::string_view field, bool decimal_comma = false);

std::string capitals(std::string_view);

}  // namespace moldloft::firmware_like
