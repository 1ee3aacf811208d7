#include "geometry/stripes/matching_failure.hpp"

namespace moldloft::geometry {

std::string describe(const MatchingFailure& failure) {
  std::string words{to_string(failure.error)};
  if (failure.stripe >= 0) words += ": stripe " + std::to_string(failure.stripe);
  if (failure.other >= 0) words += ", which is where stripe " + std::to_string(failure.other) + " is";
  if (failure.control.i >= 0)
    words += ": control point (" + std::to_string(failure.control.i) + ", " +
             std::to_string(failure.control.j) + ")";
  return words;
}

}  // namespace moldloft::geometry
