#include "geometry/cad/cad_text.hpp"

#include <array>
#include <cassert>
#include <charconv>
#include <cmath>
#include <cstdint>

namespace moldloft::geometry {

namespace {

std::string real(double x, char exponent) {
  assert(std::isfinite(x));
  std::array<char, 32> digits;
  const auto end = std::to_chars(digits.data(), digits.data() + digits.size(), x).ptr;
  std::string text(digits.data(), end);
  const std::size_t e = text.find('e');
  if (text.find('.') == text.npos) text.insert(e == text.npos ? text.size() : e, 1, '.');
  if (e != text.npos) text[text.find('e')] = exponent;
  return text;
}

constexpr std::uint32_t replacement = 0xFFFD;

// The next character of `text`, which is shortened by it. Overlong forms, surrogates and stray
// bytes are replaced.
std::uint32_t next_character(std::string_view& text) {
  const auto byte = [&](std::size_t i) { return static_cast<std::uint8_t>(text[i]); };
  const std::uint8_t first = byte(0);
  const std::size_t size = first < 0x80   ? 1
                           : first < 0xC2 ? 0
                           : first < 0xE0 ? 2
                           : first < 0xF0 ? 3
                           : first < 0xF5 ? 4
                                          : 0;
  if (size <= 1 || size > text.size()) {
    text.remove_prefix(1);
    return size == 1 ? first : replacement;
  }
  std::uint32_t character = first & (0x7Fu >> size);
  for (std::size_t i = 1; i < size; ++i) {
    if ((byte(i) & 0xC0) != 0x80) {
      text.remove_prefix(i);
      return replacement;
    }
    character = character << 6 | (byte(i) & 0x3Fu);
  }
  text.remove_prefix(size);
  constexpr std::array<std::uint32_t, 5> least = {0, 0, 0x80, 0x800, 0x10000};
  const bool valid =
      character >= least[size] && character <= 0x10FFFF && (character < 0xD800 || character > 0xDFFF);
  return valid ? character : replacement;
}

bool printable(std::uint32_t c) { return c >= 0x20 && c < 0x7F; }

void append_hex(std::string& out, std::uint32_t c, int digits) {
  for (int shift = 4 * (digits - 1); shift >= 0; shift -= 4) out += "0123456789ABCDEF"[c >> shift & 0xF];
}

}  // namespace

std::string step_real(double x) { return real(x, 'E'); }
std::string iges_real(double x) { return real(x, 'D'); }

std::string step_string(std::string_view utf8) {
  std::string out = "'";
  while (!utf8.empty()) {
    const std::uint32_t c = next_character(utf8);
    if (!printable(c)) {
      const bool wide = c > 0xFFFF;
      out += wide ? "\\X4\\" : "\\X2\\";
      append_hex(out, c, wide ? 8 : 4);
      out += "\\X0\\";
      continue;
    }
    if (c == '\'' || c == '\\') out += static_cast<char>(c);
    out += static_cast<char>(c);
  }
  return out + "'";
}

std::string iges_string(std::string_view utf8) {
  std::string text;
  while (!utf8.empty()) {
    const std::uint32_t c = next_character(utf8);
    text += printable(c) ? static_cast<char>(c) : '?';
  }
  return text.empty() ? text : std::to_string(text.size()) + "H" + text;
}

}  // namespace moldloft::geometry
