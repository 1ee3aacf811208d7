#include "host_sim/meshes/stl_reader.hpp"

#include "host_sim/meshes/text_cursor.hpp"

#include <fmt/format.h>

#include <cstdint>
#include <cstring>
#include <limits>
#include <optional>

namespace moldloft::host_sim {

namespace {

constexpr std::size_t head_bytes = 84,
                      facet_bytes = 50;  // a title of 80 and the count; normal, corners, attribute

std::size_t facets_announced(std::string_view bytes) {
  std::uint32_t count = 0;
  std::memcpy(&count, bytes.data() + head_bytes - sizeof count, sizeof count);
  return count;
}

class TextReader {
 public:
  TextReader(const std::string& name, std::string_view bytes) : name_(name), cursor_(bytes) {}

  std::expected<MeshFile, SimError> read() {
    bool open = false;
    for (auto word = cursor_.word(); !word.empty(); word = cursor_.word()) {
      const std::string keyword = lower_case(word);
      std::string_view title;
      if (keyword == "solid" || keyword == "endsolid") {
        open = keyword == "solid";
        cursor_.line_rest(title);
      } else if (keyword == "facet") {
        if (const auto wrong = facet()) return refused(*wrong);
      } else {
        return refused(fmt::format("'{}' stands where a facet begins or the solid ends", printable(word)));
      }
    }
    if (open) return refused("the file ends without endsolid: it is cut off");
    if (!faces_.cut_into_triangles(file_.mesh)) return refused("a facet has more than 5000 corners");
    if (file_.mesh.triangles.empty()) return refused("the solid has no facets: export it anew");
    return std::move(file_);
  }

 private:
  std::unexpected<SimError> refused(std::string_view why) const {
    return std::unexpected(SimError{fmt::format("{}:{}: {}", name_, cursor_.line(), why)});
  }
  static std::string printable(std::string_view word) {
    std::string text{word.substr(0, 40)};
    for (char& c : text) c = c > ' ' && c < '\x7f' ? c : '?';
    return text;
  }

  // From behind "facet" to "endfacet". A normal is whatever stands before "outer".
  std::optional<std::string> facet() {
    corners_.clear();
    bool in_loop = false;
    for (int words = 0;; ++words) {
      const auto word = cursor_.word();
      if (word.empty()) return "the file ends inside a facet: it is cut off";
      const std::string keyword = lower_case(word);
      if (keyword == "endfacet") break;
      if (keyword == "vertex") {
        if (const auto wrong = vertex()) return wrong;
      } else if (keyword == "outer") {
        in_loop = true;
      } else if (keyword == "facet" || keyword == "endsolid" ||
                 (in_loop && keyword != "loop" && keyword != "endloop")) {
        return fmt::format("'{}' stands inside a facet", printable(word));
      }
      if (!in_loop && words > 8) return "a facet has no outer loop";
    }
    if (corners_.size() < 3) return fmt::format("a facet has {} corners", corners_.size());
    faces_.add(corners_);
    return std::nullopt;
  }

  std::optional<std::string> vertex() {
    Eigen::Vector3d p;
    for (double& value : p) {
      const auto word = cursor_.word();
      const auto number = number_in(word);
      if (!number) return word.empty() ? "the file ends inside a vertex: it is cut off" : why_no_number(word);
      value = *number;
    }
    if (file_.mesh.vertices.size() >= static_cast<std::size_t>(std::numeric_limits<int>::max()))
      return "has too many vertices";
    corners_.push_back(static_cast<int>(file_.mesh.vertices.size()));
    file_.mesh.vertices.push_back(p);
    return std::nullopt;
  }

  const std::string& name_;
  TextCursor cursor_;
  MeshFile file_;
  Polygons faces_;
  std::vector<int> corners_;
};

}  // namespace

// A file is binary if its count fits its length to the byte, whatever its title. It is binary too if its
// title is "solid" but holds bytes that no text has.
bool is_binary_stl(std::string_view bytes) {
  if (bytes.size() < head_bytes) return false;
  if (bytes.size() == head_bytes + facet_bytes * facets_announced(bytes)) return true;
  return begins_as_text_stl(bytes) && bytes.substr(0, head_bytes).find('\0') != bytes.npos;
}

bool begins_as_text_stl(std::string_view bytes) {
  return lower_case(TextCursor(bytes.substr(0, 256)).word()) == "solid";
}

std::expected<MeshFile, SimError> read_binary_stl(const std::string& name, std::string_view bytes) {
  const auto refused = [&](std::string_view why) {
    return std::unexpected(SimError{fmt::format("{}: {}", name, why)});
  };
  const std::size_t count = facets_announced(bytes), there = (bytes.size() - head_bytes) / facet_bytes;
  if (count == 0) return refused("this binary STL has no facets: export it anew");
  if (count > there)
    return refused(
        fmt::format("byte {}: this binary STL announces {} facets, but {} are there: it is cut off",
                    bytes.size(), count, there));
  MeshFile file;
  if (count > static_cast<std::size_t>(std::numeric_limits<int>::max()) / 3)
    return refused("has too many facets");
  file.mesh.vertices.reserve(3 * count);
  file.mesh.triangles.reserve(count);
  for (std::size_t k = 0; k < count; ++k) {
    float corners[9];
    std::memcpy(corners, bytes.data() + head_bytes + k * facet_bytes + 12, sizeof corners);
    const int first = static_cast<int>(3 * k);
    for (std::size_t c = 0; c < 9; c += 3)
      file.mesh.vertices.emplace_back(corners[c], corners[c + 1], corners[c + 2]);
    file.mesh.triangles.push_back({first, first + 1, first + 2});
  }
  if (bytes.size() > head_bytes + count * facet_bytes)
    file.remarks.push_back("something follows the last facet that the head announces; it was left out");
  file.number_step = single_step(file.mesh.vertices);
  return file;
}

std::expected<MeshFile, SimError> read_text_stl(const std::string& name, std::string_view bytes) {
  return TextReader(name, bytes).read();
}

}  // namespace moldloft::host_sim
