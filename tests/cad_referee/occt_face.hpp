// A CAD file as OpenCASCADE understands it.
#pragma once

#include "geometry/splines/bspline.hpp"

#include <Eigen/Core>

#include <string>
#include <vector>

namespace moldloft::referee {

struct OcctFace {
  int faces = 0;                     // in the file
  bool valid = false;                // BRepCheck_Analyzer: of the first of them, its edges and corners
  geometry::BSplineSurface surface;  // poles and knots as they were read
  int wires = 0, edges = 0;
  double area = 0, area_error = 0;  // mm^2; the error is OpenCASCADE's own estimate, relative
  double outline = 0;               // mm, all wires
  double tolerance = 0;             // the largest of an edge or corner, mm
  Eigen::Vector3d normal;           // in the middle of the knots, the face's orientation taken in
  std::string name;                 // of the product, STEP only
  // A triangulation, to look at and to ask where the face is.
  std::vector<Eigen::Vector3d> points;
  std::vector<Eigen::Vector3i> triangles;
  // Whether the plan position lies on the face, by the triangulation.
  bool covers(double x, double y) const;
};

OcctFace read_step(const std::string& path);
OcctFace read_iges(const std::string& path);

}  // namespace moldloft::referee
