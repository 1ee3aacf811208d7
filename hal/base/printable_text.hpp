// Text from outside (a device, a file's name, a configuration, an operator), made printable: valid UTF-8
// without control characters, on one line, of bounded length. People and every file that we write get
// only such text.
//
//     tab and line end                       a blank
//     other control characters, NUL too      ?
//     separators, direction marks            ?   (U+2028, U+202E and their kind would turn a terminal's line around)
//     surrogates, overlong forms, no         each byte for itself: from 0xA1 on the letter that Latin-1 has there,
//     characters, bytes that are no UTF-8    which is what devices send ("61 °C"), else ?
//
// Printable text stays as it is, so doing it twice does no harm.
//
// Thread       any: no state
// Allocation   make_printable: none; the others as their result does
#pragma once

#include "hal/base/fixed_text.hpp"

#include <span>
#include <string>
#include <string_view>

namespace moldloft::hal {

// Writes as many whole characters as fit into `out`; returns their number of bytes.
std::size_t make_printable(std::string_view text, std::span<char> out) noexcept MOLDLOFT_NONBLOCKING;

template <std::size_t capacity>
FixedText<capacity> printable_text(std::string_view text) noexcept MOLDLOFT_NONBLOCKING {
  std::array<char, capacity> chars;
  return FixedText<capacity>{std::string_view{chars.data(), make_printable(text, chars)}};
}

// Longer than any path that a file system takes (4096 bytes) with a sentence around it.
constexpr std::size_t longest_printable = 8192;

// A text that is longer ends in "...".
std::string printable(std::string_view text, std::size_t longest = longest_printable);

}  // namespace moldloft::hal
