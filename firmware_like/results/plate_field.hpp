// Values on a regular grid over a surface's (u, v), for maps.
#pragma once

#include "geometry/splines/bspline.hpp"

#include <string>
#include <vector>

namespace moldloft::firmware_like {

// Rows along u; cell centres. NaN is left blank.
struct PlateField {
  int count_u = 0, count_v = 0;
  std::vector<double> values;
  std::string title, unit;
  double scale = 1;  // multiplies the values for the legend (1000: shown in micrometres)
};

// The height over the plate's own best-fit plane: the shape that the yard bends.
PlateField shape_field(const geometry::BSplineSurface&, int count);

}  // namespace moldloft::firmware_like
