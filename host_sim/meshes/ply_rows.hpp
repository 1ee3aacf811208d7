// The rows of a PLY file's body, one value after another, whatever the form. A row is begun, its values are taken in
// the header's order, and it is ended. After a failure why() says what is wrong, with the place.
#pragma once

#include "host_sim/meshes/ply_header.hpp"
#include "host_sim/meshes/text_cursor.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <optional>
#include <string>
#include <utility>

namespace moldloft::host_sim {

// Each row is one line; blank lines and comments between rows are passed over.
class PlyTextRows {
 public:
  PlyTextRows(const std::string& name, std::string_view body, std::size_t line)
      : name_(name), cursor_(body, line) {}

  // An empty first word means that the text has ended; its line is kept for messages.
  bool begin_row() {
    for (std::string_view nothing;;) {
      place_ = cursor_.line();
      first_ = cursor_.word_on_line();
      const bool is_note = first_ == "comment" || first_ == "obj_info" || first_.starts_with('#');
      if (!first_.empty() && !is_note) return true;
      if (!cursor_.line_rest(nothing)) return fail("the file ends here");
    }
  }
  std::optional<double> next(PlyScalar) {
    const auto word = first_.empty() ? cursor_.word_on_line() : std::exchange(first_, {});
    if (const auto value = number_in(word)) return value;
    fail(word.empty() ? "the line has fewer values than the header says" : why_no_number(word));
    return std::nullopt;
  }
  bool end_row() {
    std::string_view rest;
    cursor_.line_rest(rest);
    return rest.empty() || fail("the line has more values than the header says");
  }
  bool fail(std::string_view why) {
    why_ = fmt::format("{}:{}: {}", name_, place_, why);
    return false;
  }
  // The fewest bytes that a row can take: a digit and what parts it from the next, a value.
  static std::size_t least_bytes(const PlyElement& element) { return 2 * element.properties.size(); }
  std::size_t bytes_left() const { return cursor_.bytes_left() + 1; }  // the last line may lack its end
  bool more_follows() { return !cursor_.word().empty(); }
  const std::string& why() const { return why_; }

 private:
  const std::string& name_;
  TextCursor cursor_;
  std::string_view first_;
  std::size_t place_ = 0;
  std::string why_;
};

class PlyBinaryRows {
 public:
  PlyBinaryRows(const std::string& name, std::string_view body, std::size_t byte, bool big_endian)
      : name_(name), rest_(body), end_(byte + body.size()), big_endian_(big_endian) {}

  bool begin_row() { return true; }
  std::optional<double> next(PlyScalar type) {
    using enum PlyScalar;
    if (rest_.size() < bytes_of(type)) {
      fail("the file ends in the middle of a row");
      return std::nullopt;
    }
    switch (type) {
      case i8:
        return take<std::int8_t>();
      case u8:
        return take<std::uint8_t>();
      case i16:
        return take<std::int16_t>();
      case u16:
        return take<std::uint16_t>();
      case i32:
        return take<std::int32_t>();
      case u32:
        return take<std::uint32_t>();
      case f32:
        return take<float>();
      case f64:
        return take<double>();
    }
    return std::nullopt;
  }
  bool end_row() { return true; }
  bool fail(std::string_view why) {
    why_ = fmt::format("{}: byte {}: {}", name_, end_ - rest_.size(), why);
    return false;
  }
  static std::size_t least_bytes(const PlyElement& element) {
    std::size_t bytes = 0;
    for (const auto& property : element.properties)
      bytes += bytes_of(property.list_count.value_or(property.type));
    return bytes;
  }
  std::size_t bytes_left() const { return rest_.size(); }
  bool more_follows() const { return rest_.find_first_not_of(std::string_view{"\0\r\n", 3}) != rest_.npos; }
  const std::string& why() const { return why_; }

 private:
  template <typename T>
  double take() {
    char bytes[sizeof(T)];
    std::memcpy(bytes, rest_.data(), sizeof(T));
    if (big_endian_) std::reverse(bytes, bytes + sizeof(T));
    T value;
    std::memcpy(&value, bytes, sizeof(T));
    rest_.remove_prefix(sizeof(T));
    return static_cast<double>(value);
  }

  const std::string& name_;
  std::string_view rest_;
  std::size_t end_;
  bool big_endian_;
  std::string why_;
};

}  // namespace moldloft::host_sim
