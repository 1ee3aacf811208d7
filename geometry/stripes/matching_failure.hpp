// What is wrong with stripes that should make a surface, and where: for a person to read, for a program
// to act on.
#pragma once

#include "geometry/error.hpp"

#include <string>

namespace moldloft::geometry {

struct NetIndex {
  int i = -1, j = -1;  // of a control point: along u, along v
};

struct MatchingFailure {
  Error error{};
  int stripe = -1, other = -1;  // the stripe that is wrong, and the one that it coincides with
  NetIndex control{};           // the control point that the stripes leave free
  double condition = 0;         // singular: of the equations, where it was estimated
};

std::string describe(const MatchingFailure&);  // "error: stripe 3, which is where stripe 1 is"

}  // namespace moldloft::geometry
