// Makes one clean sheet of the triangles that a file holds, and says what it did.
//
// In this order: faces that span nothing and faces that are there twice are dropped; seams are welded; fins are
// dropped; the faces are turned the same way round; loose pieces are left out. Slivers that sew two differently divided
// sides together stay: without them the sheet would come apart.
//
// Unit         mm
// Cost         linear
// Failure      one line that names the place: a face's vertex that is not a number, corners that fell together because
//              the file has too few digits, edges with three faces, a one-sided surface, several sheets
#pragma once

#include "host_sim/base/sim_error.hpp"
#include "host_sim/meshes/triangle_mesh.hpp"

#include <expected>
#include <string>

namespace moldloft::host_sim {

// Seams are welded up to a thousandth of the mesh's typical (median) edge. The width is at least 0.002 mm
// where that is no more than a hundredth of the edge, and never more than 0.05 mm.
double seam_tolerance_mm(double typical_edge_mm);

struct MeshRepairs {
  int seam_vertices = 0;  // welded over a distance
  double widest_seam_mm = 0, seam_tolerance_mm = 0;
  int slivers = 0, doubles = 0, fins = 0;  // faces dropped
  int turned = 0;                          // faces
  int pieces = 0;                          // loose ones, left out
  double pieces_share = 0;                 // of the area
  double typical_edge_mm = 0;

  // "welded 13 vertices along a seam (at most 0.000001 mm apart), turned 110 faces"; empty when nothing was done.
  std::string said() const;
};

// The first of the vertices becomes the origin, so that a far one costs no digits; `name` stands in messages.
std::expected<MeshRepairs, SimError> repair(const std::string& name, TriangleMesh&);

}  // namespace moldloft::host_sim
