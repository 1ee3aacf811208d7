// A short text that lives inside its owner, for messages where the heap must not be used.
//
// Thread       a value, like an int
// Blocking     never
// Allocation   none
// Failure      a text that does not fit is cut at the capacity, never within a character of UTF-8
#pragma once

#include "hal/base/realtime.hpp"

#include <fmt/format.h>

#include <array>
#include <cstring>
#include <string_view>
#include <type_traits>
#include <utility>

namespace moldloft::hal {

// A pattern of fmt. It is checked against the arguments' types at compile time.
template <typename... Args>
struct BasicTextPattern {
  MOLDLOFT_EFFECTS_UNCHECKED_BEGIN
  template <typename Text>
  consteval BasicTextPattern(const Text& text) MOLDLOFT_NONBLOCKING  // NOLINT(google-explicit-constructor)
      : pattern{text} {}
  MOLDLOFT_EFFECTS_UNCHECKED_END
  fmt::format_string<Args...> pattern;
};
template <typename... Args>
using TextPattern = BasicTextPattern<std::type_identity_t<Args>...>;

// How many of the first `size` bytes are whole characters of UTF-8, when the text goes on behind them. A
// character that the cut divides is left out. Bytes that are no UTF-8 stay as they are.
inline std::size_t whole_characters(const char* text, std::size_t size) noexcept MOLDLOFT_NONBLOCKING {
  for (std::size_t back = 1; back <= 3 && back <= size; ++back) {
    const auto byte = static_cast<unsigned char>(text[size - back]);
    if ((byte & 0xC0) == 0x80) continue;  // not a character's first byte
    const std::size_t length = byte >= 0xF0 ? 4 : byte >= 0xE0 ? 3 : byte >= 0xC0 ? 2 : 1;
    return length > back ? size - back : size;
  }
  return size;
}

template <std::size_t capacity>
class FixedText {
 public:
  FixedText() = default;
  FixedText(std::string_view text) { assign(text); }  // NOLINT(google-explicit-constructor): a text is a text
  FixedText(const char* text) { assign(text); }       // NOLINT(google-explicit-constructor)

  template <typename... Args>
  static FixedText format(TextPattern<Args...> text_pattern, Args&&... args) MOLDLOFT_NONBLOCKING {
    FixedText text;
    // fmt writes into this buffer. It would throw for a pattern that does not fit, but such a pattern
    // does not compile.
    const auto result = checked_at_run_time([&] {
      return fmt::format_to_n(text.chars_.data(), capacity, text_pattern.pattern,
                              std::forward<Args>(args)...);
    });
    text.size_ = result.size <= capacity ? result.size : whole_characters(text.chars_.data(), capacity);
    return text;
  }

  void assign(std::string_view text) noexcept {
    size_ = text.size() <= capacity ? text.size() : whole_characters(text.data(), capacity);
    if (size_ > 0) std::memcpy(chars_.data(), text.data(), size_);
  }
  std::string_view view() const noexcept { return {chars_.data(), size_}; }
  operator std::string_view() const noexcept { return view(); }  // NOLINT(google-explicit-constructor)
  bool empty() const noexcept { return size_ == 0; }

 private:
  std::array<char, capacity> chars_{};
  std::size_t size_ = 0;
};

// One line for a person: what happened, where, what to do.
using Message = FixedText<160>;

}  // namespace moldloft::hal
