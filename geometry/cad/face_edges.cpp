#include "geometry/cad/face_edges.hpp"

#include <cmath>

namespace moldloft::geometry {

namespace {

FaceLoop ready(const BSplineSurface& surface, const TrimLoop& loop, double tolerance_mm) {
  FaceLoop all;
  for (const TrimCurve& curve : loop) {
    all.edges.push_back({curve.image ? *curve.image : image_on(surface, curve.path, tolerance_mm), curve.path,
                         curve.reversed});
  }
  return all;
}

}  // namespace

std::expected<std::vector<FaceLoop>, Error> face_edges(const TrimmedSurface& face, double tolerance_mm) {
  if (!(tolerance_mm > 0) || !std::isfinite(tolerance_mm)) return std::unexpected(Error::impossible_setting);
  if (auto checked = check(face, tolerance_mm); !checked) return std::unexpected(checked.error());
  std::vector<FaceLoop> loops;
  const bool natural = face.outer.empty();
  loops.push_back(ready(face.surface, natural ? natural_border(face.surface) : face.outer, tolerance_mm));
  loops.back().natural = natural;
  for (const TrimLoop& hole : face.holes) loops.push_back(ready(face.surface, hole, tolerance_mm));
  return loops;
}

KnotList knot_list(const std::vector<double>& knots) {
  KnotList list;
  for (const double k : knots) {
    if (list.value.empty() || list.value.back() != k) {
      list.value.push_back(k);
      list.multiplicity.push_back(0);
    }
    ++list.multiplicity.back();
  }
  return list;
}

}  // namespace moldloft::geometry
