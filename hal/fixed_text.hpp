// A short text that lives inside its owner: what a message is made of where the heap is out of bounds.
//
// Thread       a value, like an int
// Blocking     never
// Allocation   none
// Failure      a text that does not fit is cut at the capacity
#pragma once

#include <fmt/format.h>

#include <array>
#include <string_view>
#include <utility>

namespace moldloft::hal {

template <std::size_t capacity>
class FixedText {
 public:
  FixedText() = default;
  FixedText(std::string_view text) { assign(text); }  // NOLINT(google-explicit-constructor): a text is a text
  FixedText(const char* text) { assign(text); }       // NOLINT(google-explicit-constructor)

  template <typename... Args>
  static FixedText format(fmt::format_string<Args...> pattern, Args&&... args) {
    FixedText text;
    const auto result = fmt::format_to_n(text.chars_.data(), capacity, pattern, std::forward<Args>(args)...);
    text.size_ = result.size < capacity ? result.size : capacity;
    return text;
  }

  void assign(std::string_view text) noexcept {
    size_ = text.size() < capacity ? text.size() : capacity;
    text.copy(chars_.data(), size_);
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
