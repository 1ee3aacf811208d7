// Points of a coordinate measuring machine, or any list of places: XYZ, ASC, CSV, `POINT,X,Y,Z,I,J,K`.
//
// Tolerated    commas, semicolons, tabs or blanks between numbers; decimal commas (not with separating ones); heads,
//              remarks (#, //, !, %, $), names or numbers before the coordinates; normals or other columns
//              behind. A head that names x, y and z says which columns they are
// Units        as a line of the file says ("unit mm", "x [in]"), else nobody knows yet
// Thread       any; pure
// Failure      one line: which line, and what is wrong with it
#pragma once

#include "firmware_like/process/failure.hpp"

#include <Eigen/Core>

#include <expected>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace moldloft::firmware_like {

struct PointList {
  std::vector<Eigen::Vector3d> points;  // in the list's unit
  std::optional<double> mm_per_unit;
  std::string understood;  // how the lines were read, for a person
};

std::expected<PointList, Failure> read_points(std::string_view text, const std::string& file);

// mm, cm, m, in, inch, ft, um and their longer words.
std::optional<double> mm_per_unit_named(std::string_view);

}  // namespace moldloft::firmware_like
