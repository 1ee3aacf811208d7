#include "host_sim/ply_reader.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <iterator>
#include <map>
#include <optional>
#include <sstream>
#include <string_view>

namespace moldloft::host_sim {

namespace {

enum class Scalar { i8, u8, i16, u16, i32, u32, f32, f64 };

std::optional<Scalar> scalar_named(std::string_view name) {
  static constexpr std::pair<std::string_view, Scalar> names[] = {
      {"char", Scalar::i8},   {"int8", Scalar::i8},     {"uchar", Scalar::u8},   {"uint8", Scalar::u8},
      {"short", Scalar::i16}, {"int16", Scalar::i16},   {"ushort", Scalar::u16}, {"uint16", Scalar::u16},
      {"int", Scalar::i32},   {"int32", Scalar::i32},   {"uint", Scalar::u32},   {"uint32", Scalar::u32},
      {"float", Scalar::f32}, {"float32", Scalar::f32}, {"double", Scalar::f64}, {"float64", Scalar::f64}};
  for (const auto& [known, scalar] : names) {
    if (known == name) return scalar;
  }
  return std::nullopt;
}

struct Property {
  std::string name;
  Scalar type{};
  std::optional<Scalar> list_count;  // set when the property is a list: the type of its length
};

struct Element {
  std::string name;
  std::size_t count = 0;
  std::vector<Property> properties;
};

struct Header {
  bool binary = false;
  std::vector<Element> elements;
  std::size_t body = 0;  // where the data begins
};

using Failure = std::unexpected<SimError>;

// One value after another from the body, whatever its form.
class Body {
 public:
  Body(std::string_view bytes, bool binary) : rest_(bytes), binary_(binary) {}

  std::optional<double> next(Scalar type) { return binary_ ? next_binary(type) : next_text(); }
  std::size_t bytes_left() const { return rest_.size(); }

 private:
  template <typename T>
  std::optional<double> take() {
    static_assert(std::endian::native == std::endian::little);
    if (rest_.size() < sizeof(T)) return std::nullopt;
    T value;
    std::memcpy(&value, rest_.data(), sizeof(T));
    rest_.remove_prefix(sizeof(T));
    return static_cast<double>(value);
  }
  std::optional<double> next_binary(Scalar type) {
    switch (type) {
      case Scalar::i8:
        return take<std::int8_t>();
      case Scalar::u8:
        return take<std::uint8_t>();
      case Scalar::i16:
        return take<std::int16_t>();
      case Scalar::u16:
        return take<std::uint16_t>();
      case Scalar::i32:
        return take<std::int32_t>();
      case Scalar::u32:
        return take<std::uint32_t>();
      case Scalar::f32:
        return take<float>();
      case Scalar::f64:
        return take<double>();
    }
    return std::nullopt;
  }
  std::optional<double> next_text() {
    const auto begin = rest_.find_first_not_of(" \t\r\n");
    if (begin == std::string_view::npos) return std::nullopt;
    rest_.remove_prefix(begin);
    double value = 0;
    const auto [end, error] = std::from_chars(rest_.data(), rest_.data() + rest_.size(), value);
    if (error != std::errc{}) return std::nullopt;
    rest_.remove_prefix(static_cast<std::size_t>(end - rest_.data()));
    return value;
  }

  std::string_view rest_;
  bool binary_;
};

std::expected<Header, SimError> read_header(const std::string& path, std::string_view bytes) {
  const auto refused = [&](auto&& why) { return Failure(SimError{fmt::format("{}: {}", path, why)}); };
  if (!bytes.starts_with("ply\n") && !bytes.starts_with("ply\r\n")) return refused("not a PLY file");
  Header header;
  bool has_format = false;
  for (std::size_t at = 0;;) {
    const auto end = bytes.find('\n', at);
    if (end == std::string_view::npos || at > 65536) return refused("the PLY header has no end_header");
    std::istringstream words{std::string{bytes.substr(at, end - at)}};
    at = end + 1;
    std::string word, a, b, c, d;
    words >> word >> a >> b >> c >> d;
    if (word == "format") {
      if (a != "ascii" && a != "binary_little_endian") {
        return refused(
            fmt::format("PLY format '{}' is not read: save it as ascii or binary_little_endian", a));
      }
      header.binary = a != "ascii";
      has_format = true;
    } else if (word == "element") {
      std::size_t count = 0;
      const auto [stop, error] = std::from_chars(b.data(), b.data() + b.size(), count);
      if (error != std::errc{} || stop != b.data() + b.size()) return refused("an element without a count");
      header.elements.push_back({a, count, {}});
    } else if (word == "property") {
      if (header.elements.empty()) return refused("a property before the first element");
      const auto type = scalar_named(a == "list" ? c : a);
      const auto count = a == "list" ? scalar_named(b) : std::nullopt;
      if (!type || (a == "list" && !count))
        return refused(fmt::format("property '{} {} {}' has no known type", a, b, c));
      header.elements.back().properties.push_back({a == "list" ? d : b, *type, count});
    } else if (word == "end_header") {
      header.body = at;
      break;
    }
  }
  if (!has_format) return refused("the PLY header has no format line");
  return header;
}

// The element's values, one row after another; `wanted` gets (property index, value) of scalars and whole
// lists.
template <typename OnRow>
bool read_rows(const Element& element, Body& body, OnRow&& on_row) {
  std::vector<double> scalars(element.properties.size());
  std::vector<double> list;
  for (std::size_t row = 0; row < element.count; ++row) {
    for (std::size_t k = 0; k < element.properties.size(); ++k) {
      const auto& property = element.properties[k];
      const auto first = body.next(property.list_count.value_or(property.type));
      if (!first) return false;
      scalars[k] = *first;
      if (!property.list_count) continue;
      if (*first < 0 || *first > static_cast<double>(body.bytes_left())) return false;
      const bool kept = property.name == "vertex_indices" || property.name == "vertex_index";
      if (kept) list.clear();
      for (auto n = static_cast<std::size_t>(*first); n > 0; --n) {
        const auto value = body.next(property.type);
        if (!value) return false;
        if (kept) list.push_back(*value);
      }
    }
    on_row(scalars, list);
  }
  return true;
}

int index_of(const Element& element, std::string_view name) {
  for (std::size_t k = 0; k < element.properties.size(); ++k) {
    if (element.properties[k].name == name && !element.properties[k].list_count) return static_cast<int>(k);
  }
  return -1;
}

}  // namespace

std::expected<TriangleMesh, SimError> read_ply(const std::string& path) {
  const auto refused = [&](auto&& why) { return Failure(SimError{fmt::format("{}: {}", path, why)}); };
  std::ifstream file(path, std::ios::binary);
  if (!file) return refused("cannot be opened");
  const std::string bytes{std::istreambuf_iterator<char>(file), {}};
  if (file.bad()) return refused("cannot be read");
  const auto header = read_header(path, bytes);
  if (!header) return Failure(header.error());

  TriangleMesh mesh;
  Body body{std::string_view{bytes}.substr(header->body), header->binary};
  bool bad_index = false;
  for (const auto& element : header->elements) {
    const int x = index_of(element, "x"), y = index_of(element, "y"), z = index_of(element, "z");
    const bool is_vertex = element.name == "vertex", is_face = element.name == "face";
    if (is_vertex && (x < 0 || y < 0 || z < 0)) return refused("its vertices have no x, y and z");
    const bool whole = read_rows(element, body, [&](const auto& scalars, const auto& list) {
      if (is_vertex) {
        mesh.vertices.emplace_back(scalars[static_cast<std::size_t>(x)], scalars[static_cast<std::size_t>(y)],
                                   scalars[static_cast<std::size_t>(z)]);
      }
      if (!is_face) return;
      for (const double index : list) {
        bad_index |= !(index >= 0 && index < static_cast<double>(mesh.vertices.size()));
      }
      for (std::size_t k = 2; k < list.size() && !bad_index; ++k) {
        mesh.triangles.push_back(
            {static_cast<int>(list[0]), static_cast<int>(list[k - 1]), static_cast<int>(list[k])});
      }
    });
    if (!whole)
      return refused(
          fmt::format("truncated: its {} elements '{}' are not all there", element.count, element.name));
  }
  if (bad_index) return refused("a face names a vertex that is not there");
  if (mesh.triangles.empty()) return refused("has no faces: a mesh is needed, not a point cloud");
  for (const auto& v : mesh.vertices) {
    if (!v.allFinite()) return refused("a vertex is not a number");
  }
  return mesh;
}

TriangleMesh welded(const TriangleMesh& mesh) {
  const auto before = [](const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
    return std::lexicographical_compare(a.data(), a.data() + 3, b.data(), b.data() + 3);
  };
  std::map<Eigen::Vector3d, int, decltype(before)> seen(before);
  TriangleMesh result;
  std::vector<int> renamed;
  for (const auto& v : mesh.vertices) {
    const auto [at, is_new] = seen.try_emplace(v, static_cast<int>(result.vertices.size()));
    if (is_new) result.vertices.push_back(v);
    renamed.push_back(at->second);
  }
  for (const auto& t : mesh.triangles) {
    const std::array<int, 3> r = {renamed[static_cast<std::size_t>(t[0])],
                                  renamed[static_cast<std::size_t>(t[1])],
                                  renamed[static_cast<std::size_t>(t[2])]};
    if (r[0] != r[1] && r[1] != r[2] && r[2] != r[0]) result.triangles.push_back(r);
  }
  return result;
}

}  // namespace moldloft::host_sim
