// A number that a person has typed, whole and within limits. "-1" for a count, "nan", "inf", "5mm" and
// "" are refused.
//
// Thread       any; pure
// Allocation   none
#pragma once

#include <charconv>
#include <string>
#include <string_view>
#include <system_error>

namespace moldloft::firmware_like {

template <typename Number>
struct Limits {
  Number min, max;
  std::string unit = {};  // behind the limits, for people; empty: none
};

// The whole of `word` as a number within the limits; not-a-number is within none.
template <typename Number>
bool read_number(std::string_view word, const Limits<Number>& limits, Number& value) {
  const char* end = word.data() + word.size();
  const auto [stopped, failed] = std::from_chars(word.data(), end, value);
  return failed == std::errc{} && stopped == end && value >= limits.min && value <= limits.max;
}

}  // namespace moldloft::firmware_like
