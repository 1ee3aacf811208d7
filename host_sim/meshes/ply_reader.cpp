#include "host_sim/meshes/ply_reader.hpp"

#include "host_sim/meshes/ply_rows.hpp"

#include <fmt/format.h>

#include <bit>
#include <cmath>
#include <limits>

namespace moldloft::host_sim {

namespace {

static_assert(std::endian::native == std::endian::little);

constexpr std::uint64_t most_vertices = std::numeric_limits<int>::max();

// The lists that name corners, and the elements that carry them.
int corner_list(const PlyElement& element) {
  const int list = element.list_named("vertex_indices");
  return list >= 0 ? list : element.list_named("vertex_index");
}

template <typename Rows>
class BodyReader {
 public:
  BodyReader(const std::string& name, const PlyHeader& header, Rows rows)
      : name_(name), header_(header), rows_(std::move(rows)) {}

  std::expected<MeshFile, SimError> read() {
    if (auto wrong = look_over()) return refused(*wrong);
    for (const auto& element : header_.elements) {
      if (!read_element(element)) return std::unexpected(SimError{rows_.why()});
    }
    auto& mesh = file_.mesh;
    if (!faces_.cut_into_triangles(mesh))
      return refused(
          "a face that is not convex has more than 5000 corners: cut the faces into triangles first");
    if (mesh.triangles.empty()) return refused("has no faces: a mesh is needed, not a point cloud");
    if (rows_.more_follows())
      file_.remarks.push_back("something follows the last row that the header announces; it was left out");
    return std::move(file_);
  }

 private:
  std::unexpected<SimError> refused(std::string_view why) const {
    return std::unexpected(SimError{fmt::format("{}: {}", name_, why)});
  }

  // What can be known from the header alone.
  std::optional<std::string> look_over() {
    const PlyElement *vertex = nullptr, *corners = nullptr;
    for (const auto& element : header_.elements) {
      if (element.name == "vertex") vertex = &element;
      if (element.name != "face" && element.name != "tristrips") continue;
      corners = &element;
      if (element.count > 0 && corner_list(element) < 0)
        return fmt::format("its element '{}' has no list vertex_indices", element.name);
    }
    if (vertex == nullptr) return "has no element 'vertex': is it a PLY of a surface?";
    for (const char* axis : {"x", "y", "z"}) {
      if (vertex->scalar_named(axis) < 0) return "its vertices have no x, y and z";
    }
    if (corners == nullptr) return "has no faces: a mesh is needed, not a point cloud";
    if (vertex->count > most_vertices)
      return fmt::format("announces {} vertices; the most are {}", vertex->count, most_vertices);
    vertices_ = static_cast<double>(vertex->count);
    return std::nullopt;
  }

  bool read_element(const PlyElement& element) {
    const std::size_t least = Rows::least_bytes(element);
    if (least == 0) return true;  // nothing is written for an element without properties
    if (element.count > rows_.bytes_left() / least) {
      rows_.begin_row();
      return rows_.fail(
          fmt::format("the header announces {} rows of '{}', but only {} bytes follow: the file is cut "
                      "off, or its header is wrong",
                      element.count, element.name, rows_.bytes_left() - (is_text ? 1 : 0)));
    }
    if (element.name == "vertex") return read_vertices(element);
    if (element.name == "face" || element.name == "tristrips") return read_corners(element);
    return read_rows(element, -1, [] { return true; });
  }

  static constexpr bool is_text = std::is_same_v<Rows, PlyTextRows>;

  template <typename OnRow>
  bool read_rows(const PlyElement& element, int kept_list, OnRow&& on_row) {
    scalars_.assign(element.properties.size(), 0.0);
    for (std::uint64_t row = 0; row < element.count; ++row) {
      if (!rows_.begin_row())
        return rows_.fail(fmt::format("the file ends after {} of {} rows of '{}': it is cut off", row,
                                      element.count, element.name));
      for (std::size_t k = 0; k < element.properties.size(); ++k) {
        const auto& property = element.properties[k];
        const auto first = rows_.next(property.list_count.value_or(property.type));
        if (!first) return false;
        scalars_[k] = *first;
        if (property.list_count && !read_list(property, *first, static_cast<int>(k) == kept_list))
          return false;
      }
      if (!on_row() || !rows_.end_row()) return false;
    }
    return true;
  }

  bool read_list(const PlyProperty& property, double length, bool kept) {
    if (!(length >= 0) || length != std::floor(length) || length > static_cast<double>(rows_.bytes_left()))
      return rows_.fail(fmt::format("a list '{}' cannot have {} values", property.name, length));
    if (kept) list_.clear();
    for (auto n = static_cast<std::size_t>(length); n > 0; --n) {
      const auto value = rows_.next(property.type);
      if (!value) return false;
      if (kept) list_.push_back(*value);
    }
    return true;
  }

  bool read_vertices(const PlyElement& element) {
    std::array<std::size_t, 3> axes{};
    bool is_single = !is_text;
    for (std::size_t k = 0; k < 3; ++k) {
      axes[k] = static_cast<std::size_t>(element.scalar_named(std::string_view{"xyz"}.substr(k, 1)));
      is_single = is_single && element.properties[axes[k]].type == PlyScalar::f32;
    }
    file_.mesh.vertices.reserve(element.count);
    const bool whole = read_rows(element, -1, [&] {
      file_.mesh.vertices.emplace_back(scalars_[axes[0]], scalars_[axes[1]], scalars_[axes[2]]);
      return true;
    });
    if (is_single) file_.number_step = single_step(file_.mesh.vertices);
    return whole;
  }

  bool read_corners(const PlyElement& element) {
    const bool strips = element.name == "tristrips";
    return read_rows(element, corner_list(element), [&] {
      corners_.clear();
      for (const double index : list_) {
        if (strips && index == -1) {
          add_strip();
          continue;
        }
        if (!(index >= 0 && index < vertices_ && index == std::floor(index))) return bad_corner(index);
        corners_.push_back(static_cast<int>(index));
      }
      if (strips)
        add_strip();
      else
        faces_.add(corners_);
      return true;
    });
  }

  void add_strip() {
    for (std::size_t k = 2; k < corners_.size(); ++k) {
      const std::size_t a = k % 2 == 0 ? k - 2 : k - 1, b = k % 2 == 0 ? k - 1 : k - 2;
      const int corners[] = {corners_[a], corners_[b], corners_[k]};
      faces_.add(corners);
    }
    corners_.clear();
  }

  bool bad_corner(double index) {
    return rows_.fail(
        fmt::format("a face names vertex {}, which is not there: {:.0f} vertices are counted from 0{}", index,
                    vertices_, index == vertices_ ? "; does it count from 1?" : ""));
  }

  const std::string& name_;
  const PlyHeader& header_;
  Rows rows_;
  MeshFile file_;
  Polygons faces_;
  double vertices_ = 0;  // how many the header announces
  std::vector<double> scalars_, list_;
  std::vector<int> corners_;
};

}  // namespace

double single_step(std::span<const Eigen::Vector3d> vertices) {
  float farthest = 0;
  for (const auto& v : vertices) {
    if (v.allFinite()) farthest = std::max(farthest, static_cast<float>(v.cwiseAbs().maxCoeff()));
  }
  return std::nextafter(farthest, std::numeric_limits<float>::infinity()) - farthest;
}

bool begins_as_ply(std::string_view bytes) {
  const auto word = TextCursor(bytes.substr(0, 64)).word();
  return lower_case(word) == "ply";
}

std::expected<MeshFile, SimError> read_ply(const std::string& name, std::string_view bytes) {
  const auto header = read_ply_header(name, bytes);
  if (!header) return std::unexpected(header.error());
  const auto body = bytes.substr(header->body_byte);
  if (header->form == PlyForm::ascii)
    return BodyReader(name, *header, PlyTextRows(name, body, header->body_line)).read();
  const bool big_endian = header->form == PlyForm::binary_big_endian;
  return BodyReader(name, *header, PlyBinaryRows(name, body, header->body_byte, big_endian)).read();
}

}  // namespace moldloft::host_sim
