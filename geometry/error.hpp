// What can go wrong with data that came from outside, as names. to_string() gives the words for a person.
#pragma once

#include <string_view>

namespace moldloft::geometry {

enum class Error {
  too_few_points,  // fewer than the unknowns, or none at all
  not_finite,      // NaN or infinity where a number was promised
  collinear,       // points that span no area, sides that do not meet
  not_four_sided,  // an outline with more or fewer than four corners
  folded_map,      // the plan map's Jacobian changes sign: (u, v) is not unique
  outside_domain,  // a point to which no (u, v) belongs
  singular,        // the normal equations have no positive pivot
  knots_not_increasing,
  capacity,     // more data than the memory plan holds
  empty_cells,  // cells without points, and no fairing to hold the surface there
  negative_weight,
  not_on_plate,  // the hint does not lie on anything that was measured
};

std::string_view to_string(Error) noexcept;

}  // namespace moldloft::geometry
