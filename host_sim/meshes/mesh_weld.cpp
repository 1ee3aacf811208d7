#include "host_sim/meshes/mesh_weld.hpp"

#include "host_sim/meshes/mesh_edges.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <unordered_map>

namespace moldloft::host_sim {

namespace {

std::uint64_t mixed(std::uint64_t h) {  // the finalizer of MurmurHash3
  h = (h ^ (h >> 33)) * 0xff51afd7ed558ccdULL;
  h = (h ^ (h >> 33)) * 0xc4ceb9fe1a85ec53ULL;
  return h ^ (h >> 33);
}

std::uint64_t hash_of(std::uint64_t x, std::uint64_t y, std::uint64_t z) {
  return mixed(mixed(mixed(x) + y) + z);
}

std::uint64_t hash_of(const Eigen::Vector3d& p) {  // adding zero makes one of the two zeros
  return hash_of(std::bit_cast<std::uint64_t>(p.x() + 0.0), std::bit_cast<std::uint64_t>(p.y() + 0.0),
                 std::bit_cast<std::uint64_t>(p.z() + 0.0));
}

// Border vertices in cubes of the tolerance's size, so that all within it lie in the neighbouring cubes.
class CubeGrid {
 public:
  explicit CubeGrid(double side) : side_(side) {}

  void add(const Eigen::Vector3d& p, int vertex) { cubes_.emplace(key(cube_of(p)), vertex); }

  template <typename Visit>
  void near(const Eigen::Vector3d& p, Visit&& visit) const {
    const Cube middle = cube_of(p);
    for (std::int64_t i = -1; i <= 1; ++i) {
      for (std::int64_t j = -1; j <= 1; ++j) {
        for (std::int64_t k = -1; k <= 1; ++k) {
          const auto [first, last] = cubes_.equal_range(key({middle[0] + i, middle[1] + j, middle[2] + k}));
          for (auto at = first; at != last; ++at) visit(at->second);
        }
      }
    }
  }

 private:
  using Cube = std::array<std::int64_t, 3>;
  Cube cube_of(const Eigen::Vector3d& p) const {
    return {std::llround(p.x() / side_), std::llround(p.y() / side_), std::llround(p.z() / side_)};
  }
  static std::uint64_t key(const Cube& c) {
    return hash_of(static_cast<std::uint64_t>(c[0]), static_cast<std::uint64_t>(c[1]),
                   static_cast<std::uint64_t>(c[2]));
  }

  double side_;
  std::unordered_multimap<std::uint64_t, int> cubes_;
};

}  // namespace

TriangleMesh welded(const TriangleMesh& mesh) {
  const std::size_t slots = std::bit_ceil(2 * mesh.vertices.size() + 16);
  std::vector<int> table(slots, -1), renamed(mesh.vertices.size(), -1);
  TriangleMesh result;
  result.triangles = mesh.triangles;
  for (auto& t : result.triangles) {
    for (int& corner : t) {
      int& name = renamed[static_cast<std::size_t>(corner)];
      if (name < 0) {
        const auto& p = mesh.vertices[static_cast<std::size_t>(corner)];
        std::size_t slot = hash_of(p) & (slots - 1);
        while (table[slot] >= 0 && result.vertices[static_cast<std::size_t>(table[slot])] != p)
          slot = (slot + 1) & (slots - 1);
        if (table[slot] < 0) {
          table[slot] = static_cast<int>(result.vertices.size());
          result.vertices.push_back(p);
        }
        name = table[slot];
      }
      corner = name;
    }
  }
  return result;
}

SeamWeld weld_seams(TriangleMesh& mesh, const std::vector<int>& mates, double tolerance_mm) {
  std::vector<double> reach(mesh.vertices.size(), -1);  // negative: not on the border
  std::vector<int> border;
  for (std::size_t h = 0; h < mates.size(); ++h) {
    if (mates[h] != free_edge) continue;
    const int ends[] = {start_of(mesh, static_cast<int>(h)), end_of(mesh, static_cast<int>(h))};
    const double length =
        (mesh.vertices[static_cast<std::size_t>(ends[0])] - mesh.vertices[static_cast<std::size_t>(ends[1])])
            .norm();
    for (const int v : ends) {
      double& r = reach[static_cast<std::size_t>(v)];
      if (r < 0) border.push_back(v), r = tolerance_mm;
      r = std::min(r, 0.25 * length);
    }
  }
  std::sort(border.begin(), border.end());

  SeamWeld done;
  CubeGrid kept(tolerance_mm);
  std::vector<int> renamed(mesh.vertices.size());
  for (std::size_t v = 0; v < renamed.size(); ++v) renamed[v] = static_cast<int>(v);
  for (const int v : border) {
    const auto& p = mesh.vertices[static_cast<std::size_t>(v)];
    int nearest = -1;
    double distance = std::numeric_limits<double>::infinity();
    kept.near(p, [&](int other) {
      const double d = (mesh.vertices[static_cast<std::size_t>(other)] - p).norm();
      const bool in_reach =
          d <= reach[static_cast<std::size_t>(v)] && d <= reach[static_cast<std::size_t>(other)];
      if (in_reach && (d < distance || (d == distance && other < nearest))) distance = d, nearest = other;
    });
    if (nearest < 0) {
      kept.add(p, v);
      continue;
    }
    renamed[static_cast<std::size_t>(v)] = nearest;
    ++done.vertices;
    done.widest_mm = std::max(done.widest_mm, distance);
  }
  if (done.vertices > 0) {
    for (auto& t : mesh.triangles) {
      for (int& corner : t) corner = renamed[static_cast<std::size_t>(corner)];
    }
  }
  return done;
}

}  // namespace moldloft::host_sim
