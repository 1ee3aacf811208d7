// Which faces of a mesh lie beside each other.
//
// Half-edge 3 t + k is the side of triangle t from its corner k to the next. Its mate is the other half-edge between
// the same two vertices, whichever way that one runs.
//
// Cost         linear but for vertices in very many faces, n log n there
#pragma once

#include "host_sim/meshes/triangle_mesh.hpp"

#include <vector>

namespace moldloft::host_sim {

constexpr int free_edge = -1;     // only this face has it: a border
constexpr int crowded_edge = -2;  // three faces or more have it

std::vector<int> edge_mates(const TriangleMesh&);

inline int next_in_face(int half_edge) { return half_edge % 3 == 2 ? half_edge - 2 : half_edge + 1; }
inline int start_of(const TriangleMesh& mesh, int half_edge) {
  return mesh.triangles[static_cast<std::size_t>(half_edge / 3)][static_cast<std::size_t>(half_edge % 3)];
}
inline int end_of(const TriangleMesh& mesh, int half_edge) { return start_of(mesh, next_in_face(half_edge)); }

// The closed borders of a mesh whose faces all run the same way round, each a list of vertices with the surface on its
// left. Where borders touch in a vertex, each goes on along its own faces. No edge may be crowded.
std::vector<std::vector<int>> border_loops(const TriangleMesh&, const std::vector<int>& mates);

}  // namespace moldloft::host_sim
