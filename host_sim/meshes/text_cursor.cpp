#include "host_sim/meshes/text_cursor.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>
#include <cstdlib>
#include <limits>

namespace moldloft::host_sim {

namespace {

bool ends_line(char c) { return c == '\n' || c == '\r'; }
// A zero byte and ctrl-Z fill the end of some files.
bool is_blank(char c) { return c == ' ' || c == '\t' || c == '\v' || c == '\f' || c == '\0' || c == '\x1a'; }

// What a message may show of a word: short and printable.
std::string shown(std::string_view word) {
  std::string text{word.substr(0, 40)};
  for (char& c : text) {
    if (std::isprint(static_cast<unsigned char>(c)) == 0) c = '?';
  }
  return word.size() > 40 ? text + "..." : text;
}

// Numbers that from_chars() does not know: out of range, exponents of D, and what old libraries print for no number.
std::optional<double> odd_number(std::string_view word) {
  std::string text = lower_case(word);
  if (text.find("#ind") != text.npos || text.find("#qnan") != text.npos || text.find("#snan") != text.npos)
    return std::numeric_limits<double>::quiet_NaN();
  if (text.find("#inf") != text.npos) return std::numeric_limits<double>::infinity();
  if (text.find_first_not_of("0123456789+-.ed") != text.npos || text.empty()) return std::nullopt;
  std::replace(text.begin(), text.end(), 'd', 'e');
  char* end = nullptr;
  const double value = std::strtod(text.c_str(), &end);
  if (end != text.c_str() + text.size() || end == text.c_str()) return std::nullopt;
  return value;
}

}  // namespace

std::string_view TextCursor::word_on_line() {
  while (at_ != end_ && is_blank(*at_)) ++at_;
  const char* const begin = at_;
  while (at_ != end_ && !is_blank(*at_) && !ends_line(*at_)) ++at_;
  return {begin, static_cast<std::size_t>(at_ - begin)};
}

std::string_view TextCursor::word() {
  for (;;) {
    const auto found = word_on_line();
    std::string_view nothing;
    if (!found.empty() || !line_rest(nothing)) return found;
  }
}

bool TextCursor::line_rest(std::string_view& rest) {
  while (at_ != end_ && is_blank(*at_)) ++at_;
  const char* const begin = at_;
  while (at_ != end_ && !ends_line(*at_)) ++at_;
  const char* last = at_;
  while (last != begin && is_blank(last[-1])) --last;
  rest = {begin, static_cast<std::size_t>(last - begin)};
  if (at_ == end_) return !rest.empty();
  const bool two = *at_ == '\r' && end_ - at_ > 1 && at_[1] == '\n';
  at_ += two ? 2 : 1;
  ++line_;
  return true;
}

std::string lower_case(std::string_view word) {
  std::string text{word};
  for (char& c : text) {
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  }
  return text;
}

std::optional<double> number_in(std::string_view word) {
  if (word.starts_with('+')) word.remove_prefix(1);
  if (word.starts_with('+') || word.starts_with("-+")) return std::nullopt;
  double value = 0;
  const char* const end = word.data() + word.size();
  const auto [stop, error] = std::from_chars(word.data(), end, value);
  if (error == std::errc{} && stop == end) return value;
  return odd_number(word);
}

std::string why_no_number(std::string_view word) {
  const auto comma = word.find(',');
  if (comma == word.npos) return fmt::format("'{}' is not a number", shown(word));
  std::string point{word};
  point[comma] = '.';
  if (comma > 0 && number_in(point))
    return fmt::format("'{}' has a decimal comma; write the numbers with a point, such as {}", shown(word),
                       shown(point));
  return fmt::format("'{}' has a comma; separate the numbers by blanks", shown(word));
}

}  // namespace moldloft::host_sim
