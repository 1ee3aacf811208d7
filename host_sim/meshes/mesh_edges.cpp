#include "host_sim/meshes/mesh_edges.hpp"

#include <algorithm>

namespace moldloft::host_sim {

namespace {

struct Side {
  int far = 0, half_edge = 0;  // the vertex with the larger index
};

}  // namespace

std::vector<int> edge_mates(const TriangleMesh& mesh) {
  const int sides = static_cast<int>(3 * mesh.triangles.size());
  const auto near_of = [&](int h) {
    return static_cast<std::size_t>(std::min(start_of(mesh, h), end_of(mesh, h)));
  };
  // All sides sorted into buckets by their smaller vertex: few in each.
  std::vector<std::size_t> ends(mesh.vertices.size() + 1, 0);
  for (int h = 0; h < sides; ++h) ++ends[near_of(h) + 1];
  for (std::size_t v = 1; v < ends.size(); ++v) ends[v] += ends[v - 1];
  std::vector<Side> sorted(static_cast<std::size_t>(sides));
  for (int h = 0; h < sides; ++h)
    sorted[ends[near_of(h)]++] = {std::max(start_of(mesh, h), end_of(mesh, h)), h};

  std::vector<int> mates(static_cast<std::size_t>(sides), free_edge);
  std::size_t begin = 0;
  for (std::size_t v = 0; v + 1 < ends.size(); ++v) {  // ends[v] is by now where the bucket of v ends
    const std::size_t end = ends[v];
    std::sort(sorted.begin() + static_cast<std::ptrdiff_t>(begin),
              sorted.begin() + static_cast<std::ptrdiff_t>(end), [](const Side& a, const Side& b) {
                return a.far < b.far || (a.far == b.far && a.half_edge < b.half_edge);
              });
    for (std::size_t i = begin, j = begin; i < end; i = j) {
      while (j < end && sorted[j].far == sorted[i].far) ++j;
      if (j - i == 2) {
        mates[static_cast<std::size_t>(sorted[i].half_edge)] = sorted[i + 1].half_edge;
        mates[static_cast<std::size_t>(sorted[i + 1].half_edge)] = sorted[i].half_edge;
      } else if (j - i > 2) {
        for (std::size_t k = i; k < j; ++k)
          mates[static_cast<std::size_t>(sorted[k].half_edge)] = crowded_edge;
      }
    }
    begin = end;
  }
  return mates;
}

std::vector<std::vector<int>> border_loops(const TriangleMesh& mesh, const std::vector<int>& mates) {
  std::vector<std::vector<int>> loops;
  std::vector<bool> walked(mates.size(), false);
  for (std::size_t first = 0; first < mates.size(); ++first) {
    if (mates[first] != free_edge || walked[first]) continue;
    auto& loop = loops.emplace_back();
    for (int h = static_cast<int>(first); !walked[static_cast<std::size_t>(h)];) {
      walked[static_cast<std::size_t>(h)] = true;
      loop.push_back(start_of(mesh, h));
      // Round the end vertex, face by face, to the border that leaves it.
      h = next_in_face(h);
      while (mates[static_cast<std::size_t>(h)] >= 0) h = next_in_face(mates[static_cast<std::size_t>(h)]);
    }
  }
  return loops;
}

}  // namespace moldloft::host_sim
