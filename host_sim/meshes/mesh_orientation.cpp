#include "host_sim/meshes/mesh_orientation.hpp"

#include "host_sim/meshes/mesh_edges.hpp"

#include <Eigen/Geometry>

#include <utility>

namespace moldloft::host_sim {

Orientation orient(TriangleMesh& mesh, const std::vector<int>& mates) {
  Orientation found;
  const std::size_t faces = mesh.triangles.size();
  found.sheet.assign(faces, -1);
  std::vector<bool> flipped(faces, false);  // against the sheet's first face
  std::vector<std::size_t> members;
  for (std::size_t seed = 0; seed < faces; ++seed) {
    if (found.sheet[seed] >= 0) continue;
    const int sheet = static_cast<int>(found.area_mm2.size());
    double kept_area = 0, flipped_area = 0;
    int flips = 0;
    members.assign(1, seed);
    found.sheet[seed] = sheet;
    for (std::size_t next = 0; next < members.size(); ++next) {
      const std::size_t t = members[next];
      (flipped[t] ? flipped_area : kept_area) += 0.5 * mesh.doubled_area(mesh.triangles[t]).norm();
      flips += flipped[t] ? 1 : 0;
      for (std::size_t k = 0; k < 3; ++k) {
        const int mine = static_cast<int>(3 * t + k), mate = mates[static_cast<std::size_t>(mine)];
        if (mate < 0) continue;
        const auto other = static_cast<std::size_t>(mate / 3);
        const bool opposed = start_of(mesh, mine) != start_of(mesh, mate);  // as the sides of one sheet run
        const bool other_flipped = opposed ? flipped[t] : !flipped[t];
        if (found.sheet[other] < 0) {
          found.sheet[other] = sheet;
          flipped[other] = other_flipped;
          members.push_back(other);
        } else if (flipped[other] != other_flipped && !found.one_sided) {
          found.one_sided = mesh.vertices[static_cast<std::size_t>(start_of(mesh, mine))];
        }
      }
    }
    found.area_mm2.push_back(kept_area + flipped_area);
    const bool turn_others = flipped_area > kept_area;
    for (const std::size_t t : members) flipped[t] = flipped[t] != turn_others;
    found.turned += turn_others ? static_cast<int>(members.size()) - flips : flips;
  }
  for (std::size_t t = 0; t < faces; ++t) {
    if (flipped[t]) std::swap(mesh.triangles[t][1], mesh.triangles[t][2]);
  }
  return found;
}

}  // namespace moldloft::host_sim
