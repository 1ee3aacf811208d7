// A face made ready for writing: every loop with the space curves of its edges.
//
// Accuracy     a space curve is the one that the face gives, a border row of the net bit for bit, or an image
//              within the tolerance (splines/trimmed_surface.hpp)
// Allocation   yes
// Failure      what check() of trimmed_surface.hpp finds
#pragma once

#include "geometry/splines/trimmed_surface.hpp"

#include <expected>
#include <vector>

namespace moldloft::geometry {

struct FaceEdge {
  SpaceCurve image;
  PlanCurve path;
  bool reversed = false;
};

struct FaceLoop {
  std::vector<FaceEdge> edges;
  bool natural = false;  // the border of the surface's knots: its paths say nothing new
};

// The outer loop first, then the holes.
std::expected<std::vector<FaceLoop>, Error> face_edges(const TrimmedSurface&, double tolerance_mm);

// Knots as CAD files hold them: each once, with how often it occurs.
struct KnotList {
  std::vector<double> value;
  std::vector<int> multiplicity;
};
KnotList knot_list(const std::vector<double>& knots);

}  // namespace moldloft::geometry
