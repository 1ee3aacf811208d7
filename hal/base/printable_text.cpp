#include "hal/base/printable_text.hpp"

#include <algorithm>
#include <cstdint>

namespace moldloft::hal {
namespace {

constexpr std::uint32_t no_character = 0xFFFFFFFF;

struct Character {
  std::uint32_t code = no_character;
  std::size_t size = 1;  // bytes of the text that it takes
};

// The character at the beginning of a text that is not empty, as RFC 3629 has it.
Character first_character(std::string_view text) noexcept {
  const auto byte = [&](std::size_t i) { return static_cast<std::uint8_t>(text[i]); };
  const std::uint8_t first = byte(0);
  if (first < 0x80) return {first, 1};
  const std::size_t size = first < 0xC2 ? 0 : first < 0xE0 ? 2 : first < 0xF0 ? 3 : first < 0xF5 ? 4 : 0;
  if (size == 0 || size > text.size()) return {};
  std::uint32_t code = first & (0x7Fu >> size);
  for (std::size_t i = 1; i < size; ++i) {
    if ((byte(i) & 0xC0) != 0x80) return {};
    code = code << 6 | (byte(i) & 0x3Fu);
  }
  const bool overlong = (size == 3 && code < 0x800) || (size == 4 && code < 0x10000);
  const bool surrogate = code >= 0xD800 && code <= 0xDFFF;
  return overlong || surrogate || code > 0x10FFFF ? Character{} : Character{code, size};
}

// Controls of C0 and C1, marks that break a line or turn its direction, and what Unicode says is no character.
bool has_no_shape(std::uint32_t code) noexcept {
  return code < 0x20 || (code >= 0x7F && code < 0xA0) || code == 0x61C || code == 0x200E || code == 0x200F ||
         (code >= 0x2028 && code <= 0x202E) || (code >= 0x2066 && code <= 0x2069) || code == 0xFEFF ||
         (code & 0xFFFE) == 0xFFFE || (code >= 0xFDD0 && code <= 0xFDEF);
}

}  // namespace

std::size_t make_printable(std::string_view text, std::span<char> out) noexcept {
  std::size_t used = 0;
  const auto put = [&](std::string_view piece) {
    if (piece.size() > out.size() - used) return false;
    std::ranges::copy(piece, out.begin() + static_cast<std::ptrdiff_t>(used));
    used += piece.size();
    return true;
  };
  while (!text.empty()) {
    const Character c = first_character(text);
    const auto byte = static_cast<std::uint8_t>(text.front());
    const std::array<char, 2> latin_1{static_cast<char>(0xC0 | byte >> 6),
                                      static_cast<char>(0x80 | (byte & 0x3F))};
    const std::string_view piece =
        c.code == '\t' || c.code == '\n' || c.code == '\r' ? " "
        : c.code == no_character && byte > 0xA0            ? std::string_view{latin_1.data(), latin_1.size()}
        : c.code == no_character || has_no_shape(c.code)   ? "?"
                                                           : std::string_view{text.data(), c.size};
    if (!put(piece)) break;
    text.remove_prefix(c.size);
  }
  return used;
}

std::string printable(std::string_view text, std::size_t longest) {
  constexpr std::string_view cut = "...";
  // A byte becomes two at most. One byte of room beyond the limit shows whether all of it fits.
  std::string out(std::min(2 * text.size(), longest + 4), '\0');
  out.resize(make_printable(text, out));
  if (out.size() <= longest) return out;
  std::string shorter(longest < cut.size() ? longest : longest - cut.size(), '\0');
  shorter.resize(make_printable(out, shorter));
  return longest < cut.size() ? shorter : shorter + std::string{cut};
}

}  // namespace moldloft::hal
