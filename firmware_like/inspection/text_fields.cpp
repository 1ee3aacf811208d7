#include "firmware_like/inspection/text_fields.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>

namespace moldloft::firmware_like {
namespace {

constexpr bool is_blank(char c) { return c == ' ' || c == '\t' || c == '\r' || c == '\f' || c == '\v'; }

Field trimmed(std::string_view line, std::size_t begin, std::size_t end) {
  while (begin < end && is_blank(line[begin])) ++begin;
  while (end > begin && is_blank(line[end - 1])) --end;
  return {line.substr(begin, end - begin), begin, end};
}

}  // namespace

std::vector<std::string> lines_of(std::string_view text) {
  if (text.starts_with("\xEF\xBB\xBF")) text.remove_prefix(3);
  std::vector<std::string> lines;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t end = std::min(text.find_first_of("\r\n", at), text.size());
    lines.emplace_back(text.substr(at, end - at));
    at = end + 1;
    if (end < text.size() && text[end] == '\r' && at < text.size() && text[at] == '\n') ++at;
  }
  return lines;
}

std::vector<Field> fields_of(std::string_view line, std::optional<char> separator) {
  std::vector<Field> fields;
  if (separator) {
    for (std::size_t at = 0;;) {
      const std::size_t end = std::min(line.find(*separator, at), line.size());
      fields.push_back(trimmed(line, at, end));
      if (end == line.size()) return fields;
      at = end + 1;
    }
  }
  for (std::size_t at = 0; at < line.size();) {
    while (at < line.size() && is_blank(line[at])) ++at;
    const std::size_t begin = at;
    while (at < line.size() && !is_blank(line[at])) ++at;
    if (at > begin) fields.push_back({line.substr(begin, at - begin), begin, at});
  }
  return fields;
}

std::optional<double> number_of(std::string_view field, bool decimal_comma) {
  std::string text{field};
  if (decimal_comma) std::ranges::replace(text, ',', '.');
  if (text.starts_with('+')) text.erase(0, 1);
  if (text.empty() || text.starts_with('+')) return std::nullopt;
  // Fortran writes 1.5D+01.
  const auto power = text.find_first_of("Dd");
  if (power != std::string::npos && power > 0 && power + 1 < text.size() &&
      (text[power + 1] == '+' || text[power + 1] == '-'))
    text[power] = 'E';
  double value = 0;
  const auto [stopped, failed] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (failed != std::errc{} || stopped != text.data() + text.size() || !std::isfinite(value))
    return std::nullopt;
  return value;
}

std::string capitals(std::string_view text) {
  std::string out{text};
  for (char& c : out) {
    if (c >= 'a' && c <= 'z') c = static_cast<char>(c - 'a' + 'A');
  }
  return out;
}

}  // namespace moldloft::firmware_like
