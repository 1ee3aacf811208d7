#include "geometry/error.hpp"

namespace moldloft::geometry {

std::string_view to_string(Error error) noexcept {
  switch (error) {
    case Error::too_few_points:
      return "too few points for what is asked of them";
    case Error::not_finite:
      return "a number is NaN or infinite";
    case Error::collinear:
      return "lines that should cross are parallel, or points span no area";
    case Error::not_four_sided:
      return "the outline does not have exactly four corners";
    case Error::folded_map:
      return "the outline's sides fold the plan map over itself";
    case Error::outside_domain:
      return "the position lies off the plate";
    case Error::singular:
      return "the data do not determine the surface";
    case Error::knots_not_increasing:
      return "knots decrease";
    case Error::capacity:
      return "more data than the memory plan holds";
    case Error::empty_cells:
      return "cells of the net hold no points, and no fairing was asked for";
    case Error::negative_weight:
      return "a weight is negative";
    case Error::not_on_plate:
      return "nothing was measured where the plate was expected";
  }
  return "unknown error";
}

}  // namespace moldloft::geometry
