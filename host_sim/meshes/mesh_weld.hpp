// Makes one vertex of several that mean the same place.
//
// Cost         linear
#pragma once

#include "host_sim/meshes/triangle_mesh.hpp"

#include <vector>

namespace moldloft::host_sim {

// Vertices at exactly the same place become one, the first of them; vertices that no face uses are left out. Faces keep
// their number and may lose corners.
TriangleMesh welded(const TriangleMesh&);

struct SeamWeld {
  int vertices = 0;      // that became another one
  double widest_mm = 0;  // the largest distance bridged
};

// Stitches seams: vertices of the border within `tolerance_mm` of one another become one. Two vertices of one border
// edge never do, since each reaches at most a quarter of its shortest border edge.
SeamWeld weld_seams(TriangleMesh&, const std::vector<int>& mates, double tolerance_mm);

}  // namespace moldloft::host_sim
