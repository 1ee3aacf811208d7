// What is wrong with measured points, and with which one.
#pragma once

#include "geometry/error.hpp"

#include <cstddef>
#include <limits>

namespace moldloft::geometry {

constexpr std::size_t no_point = std::numeric_limits<std::size_t>::max();

struct InspectionError {
  Error error;
  std::size_t point = no_point;  // the one that is to blame, where it is one
};

}  // namespace moldloft::geometry
