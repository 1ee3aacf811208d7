#include "host_sim/meshes/ply_header.hpp"

#include "host_sim/meshes/text_cursor.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>

namespace moldloft::host_sim {

namespace {

constexpr std::size_t most_header_bytes = std::size_t{1} << 20;

std::optional<PlyScalar> scalar_called(std::string_view name) {
  using enum PlyScalar;
  static constexpr std::pair<std::string_view, PlyScalar> names[] = {
      {"char", i8},   {"int8", i8},     {"uchar", u8},   {"uint8", u8},   {"short", i16}, {"int16", i16},
      {"int", i32},   {"int32", i32},   {"ushort", u16}, {"uint16", u16}, {"uint", u32},  {"uint32", u32},
      {"float", f32}, {"float32", f32}, {"double", f64}, {"float64", f64}};
  for (const auto& [known, scalar] : names) {
    if (known == name) return scalar;
  }
  return std::nullopt;
}

class HeaderReader {
 public:
  HeaderReader(const std::string& name, std::string_view bytes)
      : name_(name), bytes_(bytes), cursor_(bytes.substr(0, most_header_bytes)) {}

  std::expected<PlyHeader, SimError> read() {
    std::string_view line;
    cursor_.line_rest(line);  // "ply", by which the file was known
    bool has_form = false;
    for (;;) {
      const std::size_t at = cursor_.line();
      const std::string keyword = lower_case(cursor_.word_on_line());
      const bool is_last = keyword == "end_header";
      if (is_last) break;
      std::vector<std::string> words;
      while (words.size() < 5) {
        words.push_back(lower_case(cursor_.word_on_line()));
        if (words.back().empty()) break;
      }
      words.resize(5);
      std::optional<std::string> wrong;
      if (keyword == "format") {
        wrong = take_form(words[0]);
        has_form = true;
      } else if (keyword == "element") {
        wrong = take_element(words);
      } else if (keyword == "property") {
        wrong = take_property(words);
      } else if (!keyword.empty() && keyword != "comment" && keyword != "obj_info") {
        wrong = fmt::format("'{}' is no line of a PLY header", keyword.substr(0, 40));
      }
      if (wrong) return refused(at, *wrong);
      if (!cursor_.line_rest(line))
        return refused(at, "the PLY header has no end_header: the file is cut off");
    }
    if (!has_form) return refused(cursor_.line(), "the PLY header has no format line");
    find_body();
    return std::move(header_);
  }

 private:
  std::unexpected<SimError> refused(std::size_t line, std::string_view why) const {
    return std::unexpected(SimError{fmt::format("{}:{}: {}", name_, line, why)});
  }

  std::optional<std::string> take_form(const std::string& word) {
    if (word == "ascii")
      header_.form = PlyForm::ascii;
    else if (word == "binary_little_endian")
      header_.form = PlyForm::binary_little_endian;
    else if (word == "binary_big_endian")
      header_.form = PlyForm::binary_big_endian;
    else
      return fmt::format("PLY format '{}' is not known: save it as ascii or binary_little_endian",
                         word.substr(0, 40));
    return std::nullopt;
  }

  std::optional<std::string> take_element(const std::vector<std::string>& words) {
    PlyElement element{words[0], 0, {}};
    const auto& count = words[1];
    const auto [stop, error] = std::from_chars(count.data(), count.data() + count.size(), element.count);
    if (count.empty() || error != std::errc{} || stop != count.data() + count.size())
      return fmt::format("element '{}' has no count, but '{}'", element.name.substr(0, 40),
                         count.substr(0, 40));
    for (const auto& other : header_.elements) {
      if (other.name == element.name)
        return fmt::format("element '{}' is announced twice", element.name.substr(0, 40));
    }
    header_.elements.push_back(std::move(element));
    return std::nullopt;
  }

  std::optional<std::string> take_property(const std::vector<std::string>& words) {
    if (header_.elements.empty()) return "a property stands before the first element";
    const bool is_list = words[0] == "list";
    const auto type = scalar_called(words[is_list ? 2 : 0]);
    const auto count = is_list ? scalar_called(words[1]) : std::nullopt;
    const auto& name = words[is_list ? 3 : 1];
    if (!type || (is_list && !count))
      return fmt::format("property '{} {} {}' has no known type", words[0].substr(0, 40),
                         words[1].substr(0, 40), words[2].substr(0, 40));
    if (name.empty()) return "a property has no name";
    auto& properties = header_.elements.back().properties;
    for (const auto& other : properties) {
      if (other.name == name) return fmt::format("property '{}' is announced twice", name.substr(0, 40));
    }
    properties.push_back({name, *type, count});
    return std::nullopt;
  }

  // Past the line end of end_header. In binary data that follow a lone CR, the next byte may happen to be an LF.
  void find_body() {
    const std::size_t after_word = std::min(bytes_.size(), most_header_bytes) - cursor_.bytes_left();
    std::size_t at = after_word;
    while (at < bytes_.size() && (bytes_[at] == ' ' || bytes_[at] == '\t')) ++at;
    const auto first_end = bytes_.find_first_of("\r\n");
    const bool lone_cr = bytes_[first_end] == '\r' && bytes_[first_end + 1] != '\n';
    if (at < bytes_.size() && bytes_[at] == '\r') {
      ++at;
      if (!lone_cr && at < bytes_.size() && bytes_[at] == '\n') ++at;
    } else if (at < bytes_.size() && bytes_[at] == '\n') {
      ++at;
    }
    header_.body_byte = at;
    header_.body_line = cursor_.line() + 1;
  }

  const std::string& name_;
  std::string_view bytes_;
  TextCursor cursor_;
  PlyHeader header_;
};

}  // namespace

std::size_t bytes_of(PlyScalar scalar) {
  static constexpr std::size_t bytes[] = {1, 1, 2, 2, 4, 4, 4, 8};
  return bytes[static_cast<std::size_t>(scalar)];
}

int PlyElement::scalar_named(std::string_view wanted) const {
  for (std::size_t k = 0; k < properties.size(); ++k) {
    if (properties[k].name == wanted && !properties[k].list_count) return static_cast<int>(k);
  }
  return -1;
}

int PlyElement::list_named(std::string_view wanted) const {
  for (std::size_t k = 0; k < properties.size(); ++k) {
    if (properties[k].name == wanted && properties[k].list_count) return static_cast<int>(k);
  }
  return -1;
}

std::expected<PlyHeader, SimError> read_ply_header(const std::string& name, std::string_view bytes) {
  return HeaderReader(name, bytes).read();
}

}  // namespace moldloft::host_sim
