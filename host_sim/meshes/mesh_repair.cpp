#include "host_sim/meshes/mesh_repair.hpp"

#include "host_sim/meshes/mesh_edges.hpp"
#include "host_sim/meshes/mesh_orientation.hpp"
#include "host_sim/meshes/mesh_weld.hpp"

#include <Eigen/Geometry>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

namespace moldloft::host_sim {

namespace {

constexpr double sliver = 1e-5;         // a face lower than this part of its longest side spans nothing
constexpr double most_collapsed = 0.1;  // of the faces: more are no accident
constexpr double most_loose = 0.01;     // of the area: crumbs of a scan are left out, a second sheet is not
constexpr int most_rounds = 8;          // of dropping faces that only their neighbours' going sets free
constexpr std::size_t most_gap_pairs = 50'000'000;  // 0.1 s

bool lost_a_corner(const Triangle& t) { return t[0] == t[1] || t[1] == t[2] || t[2] == t[0]; }

int drop_if(TriangleMesh& mesh, auto&& unwanted) {
  return static_cast<int>(std::erase_if(mesh.triangles, unwanted));
}

// Drops faces by what is known of each by its number.
int drop_marked(TriangleMesh& mesh, const std::vector<bool>& marked) {
  std::size_t kept = 0;
  for (std::size_t t = 0; t < marked.size(); ++t) {
    if (!marked[t]) mesh.triangles[kept++] = mesh.triangles[t];
  }
  mesh.triangles.resize(kept);
  return static_cast<int>(marked.size() - kept);
}

int drop_doubles(TriangleMesh& mesh) {
  const auto key = [&](std::size_t t) {
    Triangle corners = mesh.triangles[t];
    std::sort(corners.begin(), corners.end());
    return corners;
  };
  std::vector<std::pair<Triangle, std::uint32_t>> keys(mesh.triangles.size());
  for (std::size_t t = 0; t < keys.size(); ++t) keys[t] = {key(t), static_cast<std::uint32_t>(t)};
  std::sort(keys.begin(), keys.end());
  std::vector<bool> again(keys.size(), false);
  for (std::size_t k = 1; k < keys.size(); ++k) again[keys[k].second] = keys[k].first == keys[k - 1].first;
  return drop_marked(mesh, again);
}

// Faces of no height go, but for those that sew: all three of their sides have exactly one neighbour.
int drop_slivers(TriangleMesh& mesh) {
  int dropped = 0;
  for (int round = 0; round < most_rounds; ++round) {
    std::vector<bool> marked(mesh.triangles.size(), false);
    bool any = false;
    for (std::size_t t = 0; t < marked.size(); ++t) {
      const auto& face = mesh.triangles[t];
      double longest2 = 0;
      for (std::size_t k = 0; k < 3; ++k)
        longest2 = std::max(longest2, (mesh.corner(face, (k + 1) % 3) - mesh.corner(face, k)).squaredNorm());
      marked[t] = mesh.doubled_area(face).norm() <= sliver * longest2;
      any = any || marked[t];
    }
    if (!any) break;
    const auto mates = edge_mates(mesh);
    for (std::size_t t = 0; t < marked.size(); ++t)
      marked[t] = marked[t] && (mates[3 * t] < 0 || mates[3 * t + 1] < 0 || mates[3 * t + 2] < 0);
    const int now = drop_marked(mesh, marked);
    if (now == 0) break;
    dropped += now;
  }
  return dropped;
}

// Faces that stick out of the sheet: one side where three faces meet, two that are free.
int drop_fins(TriangleMesh& mesh) {
  int dropped = 0;
  for (int round = 0; round < most_rounds; ++round) {
    const auto mates = edge_mates(mesh);
    std::vector<bool> fins(mesh.triangles.size(), false);
    for (std::size_t t = 0; t < fins.size(); ++t) {
      const auto has = [&](int kind) { return std::count(&mates[3 * t], &mates[3 * t] + 3, kind); };
      fins[t] = has(crowded_edge) == 1 && has(free_edge) == 2;
    }
    const int now = drop_marked(mesh, fins);
    if (now == 0) break;
    dropped += now;
  }
  return dropped;
}

double typical_edge(const TriangleMesh& mesh) {
  std::vector<double> lengths;
  lengths.reserve(3 * mesh.triangles.size());
  for (const auto& t : mesh.triangles) {
    for (std::size_t k = 0; k < 3; ++k)
      lengths.push_back((mesh.corner(t, (k + 1) % 3) - mesh.corner(t, k)).norm());
  }
  if (lengths.empty()) return 0;
  const auto middle = lengths.begin() + static_cast<std::ptrdiff_t>(lengths.size() / 2);
  std::nth_element(lengths.begin(), middle, lengths.end());
  return *middle;
}

std::string at_place(const Eigen::Vector3d& origin, const Eigen::Vector3d& p) {
  const Eigen::Vector3d q = origin + p;
  return fmt::format("at ({:.1f}, {:.1f}, {:.1f}) mm", q.x(), q.y(), q.z());
}

// The distance between two sheets, vertex to vertex of their borders; nothing when the borders are too long to ask.
std::optional<double> gap_between(const TriangleMesh& mesh, const std::vector<int>& mates,
                                  const std::vector<int>& sheet, int a, int b) {
  std::vector<Eigen::Vector3d> borders[2];
  for (std::size_t h = 0; h < mates.size(); ++h) {
    if (mates[h] != free_edge) continue;
    const int s = sheet[h / 3];
    if (s != a && s != b) continue;
    borders[s == a ? 0 : 1].push_back(
        mesh.vertices[static_cast<std::size_t>(start_of(mesh, static_cast<int>(h)))]);
  }
  if (borders[0].size() * borders[1].size() > most_gap_pairs) return std::nullopt;
  double least2 = std::numeric_limits<double>::infinity();
  for (const auto& p : borders[0]) {
    for (const auto& q : borders[1]) least2 = std::min(least2, (p - q).squaredNorm());
  }
  return std::isfinite(least2) ? std::optional{std::sqrt(least2)} : std::nullopt;
}

class Repair {
 public:
  Repair(const std::string& name, TriangleMesh& mesh) : name_(name), mesh_(mesh) {}

  std::expected<MeshRepairs, SimError> run() {
    if (auto wrong = find_origin()) return refused(*wrong);
    if (auto wrong = clean()) return refused(*wrong);
    stitch();
    done_.fins = drop_fins(mesh_);
    const auto mates = edge_mates(mesh_);
    if (auto wrong = crowded(mates)) return refused(*wrong);
    const auto orientation = orient(mesh_, mates);
    done_.turned = orientation.turned;
    if (orientation.one_sided)
      return refused(
          fmt::format("the surface has one side only, like a Moebius band: its faces cannot be turned the "
                      "same way round {}; repair the mesh there",
                      at_place(origin_, *orientation.one_sided)));
    if (auto wrong = keep_one_sheet(mates, orientation)) return refused(*wrong);
    return done_;
  }

 private:
  std::unexpected<SimError> refused(std::string_view why) const {
    return std::unexpected(SimError{fmt::format("{}: {}", name_, why)});
  }

  // Squares of far coordinates would swallow the plate: all is counted from one of its vertices.
  std::optional<std::string> find_origin() {
    for (const auto& t : mesh_.triangles) {
      for (std::size_t k = 0; k < 3; ++k) {
        if (!mesh_.corner(t, k).allFinite())
          return fmt::format("vertex {} is not a number, and a face uses it", t[k]);
      }
    }
    if (mesh_.triangles.empty()) return "has no faces that span an area";
    origin_ = mesh_.corner(mesh_.triangles.front(), 0);
    for (auto& v : mesh_.vertices) v -= origin_;
    return std::nullopt;
  }

  std::optional<std::string> clean() {
    done_.slivers = drop_if(mesh_, lost_a_corner);
    mesh_ = welded(mesh_);
    const auto faces = static_cast<double>(mesh_.triangles.size());
    const int collapsed = drop_if(mesh_, lost_a_corner);
    if (!mesh_.triangles.empty() && collapsed > most_collapsed * faces)
      return fmt::format(
          "{} of {:.0f} faces have two corners at the same place: the file was written with too few "
          "digits; export it with double precision or nearer to the origin",
          collapsed, faces);
    done_.slivers += collapsed + drop_slivers(mesh_);
    done_.doubles = drop_doubles(mesh_);
    if (mesh_.triangles.empty()) return "has no faces that span an area";
    return std::nullopt;
  }

  void stitch() {
    done_.typical_edge_mm = typical_edge(mesh_);
    done_.seam_tolerance_mm = seam_tolerance_mm(done_.typical_edge_mm);
    const auto weld = weld_seams(mesh_, edge_mates(mesh_), done_.seam_tolerance_mm);
    done_.seam_vertices = weld.vertices;
    done_.widest_seam_mm = weld.widest_mm;
    if (weld.vertices == 0) return;
    done_.slivers += drop_if(mesh_, lost_a_corner);
    done_.doubles += drop_doubles(mesh_);
  }

  std::optional<std::string> crowded(const std::vector<int>& mates) const {
    const auto first = std::find(mates.begin(), mates.end(), crowded_edge);
    if (first == mates.end()) return std::nullopt;
    const int h = static_cast<int>(first - mates.begin());
    return fmt::format(
        "not a single sheet: three faces or more meet in one edge {} ({} face sides are so in all); "
        "take stiffeners and doubled surfaces out",
        at_place(origin_, mesh_.vertices[static_cast<std::size_t>(start_of(mesh_, h))]),
        std::count(mates.begin(), mates.end(), crowded_edge));
  }

  std::optional<std::string> keep_one_sheet(const std::vector<int>& mates, const Orientation& o) {
    if (o.area_mm2.size() == 1) return std::nullopt;
    std::vector<int> order(o.area_mm2.size());
    std::iota(order.begin(), order.end(), 0);
    const auto area = [&](int sheet) { return o.area_mm2[static_cast<std::size_t>(sheet)]; };
    std::stable_sort(order.begin(), order.end(), [&](int a, int b) { return area(a) > area(b); });
    const double all = std::accumulate(o.area_mm2.begin(), o.area_mm2.end(), 0.0);
    const double loose = 1 - area(order[0]) / all;
    if (loose > most_loose) {
      const auto gap = gap_between(mesh_, mates, o.sheet, order[0], order[1]);
      return fmt::format(
          "not a single sheet: {} pieces that do not hang together, the largest with {:.0f} % and {:.0f} "
          "% of the area{}; export one sheet, or close the gap",
          order.size(), 100 * area(order[0]) / all, 100 * area(order[1]) / all,
          gap ? fmt::format(", {:.3g} mm apart (welded is up to {:.2g} mm, vertex to vertex)", *gap,
                            done_.seam_tolerance_mm)
              : "");
    }
    std::vector<bool> other(mesh_.triangles.size());
    for (std::size_t t = 0; t < other.size(); ++t) other[t] = o.sheet[t] != order[0];
    drop_marked(mesh_, other);
    done_.pieces = static_cast<int>(order.size()) - 1;
    done_.pieces_share = loose;
    return std::nullopt;
  }

  const std::string& name_;
  TriangleMesh& mesh_;
  MeshRepairs done_;
  Eigen::Vector3d origin_ = Eigen::Vector3d::Zero();
};

}  // namespace

double seam_tolerance_mm(double typical_edge_mm) {
  const double least = std::min(0.002, 0.01 * typical_edge_mm);
  return std::clamp(0.001 * typical_edge_mm, least, std::max(least, 0.05));
}

std::string MeshRepairs::said() const {
  std::vector<std::string> parts;
  const auto say = [&](int count, std::string_view what, std::string_view one, std::string_view many) {
    if (count > 0) parts.push_back(fmt::format("{} {} {}", what, count, count == 1 ? one : many));
  };
  say(seam_vertices, "welded", "seam vertex", "seam vertices");
  if (seam_vertices > 0) parts.back() += fmt::format(" at most {:.2g} mm apart", widest_seam_mm);
  say(turned, "turned", "face", "faces");
  say(slivers, "dropped", "sliver", "slivers");
  say(doubles, "dropped", "doubled face", "doubled faces");
  say(fins, "dropped", "fin", "fins");
  say(pieces, "left out", "loose piece", "loose pieces");
  if (pieces > 0) parts.back() += fmt::format(" of {:.2g} % of the area", 100 * pieces_share);
  return fmt::format("{}", fmt::join(parts, "; "));
}

std::expected<MeshRepairs, SimError> repair(const std::string& name, TriangleMesh& mesh) {
  return Repair(name, mesh).run();
}

}  // namespace moldloft::host_sim
