// What can go wrong with data that came from outside, as names. to_string() gives the words for a person.
#pragma once

#include "geometry/nonblocking.hpp"

#include <cstddef>
#include <string_view>

namespace moldloft::geometry {

enum class Error {
  // ---- points and numbers
  not_finite,       // NaN or infinity where a number was promised
  too_large,        // a number whose square no double holds
  too_few_points,   // fewer than the unknowns, or none at all
  repeated_points,  // consecutive points in one place, or parameters that do not increase
  collinear,        // points that span no area, sides that do not meet
  no_extent,        // all points, or the ends of a domain, at one place of an axis
  negative_weight,
  sizes_differ,        // columns or spans that belong together, of different lengths
  impossible_setting,  // a setting that its header does not allow
  capacity,            // more data than the memory plan holds
  not_on_plate,        // the hint does not lie on anything that was measured

  // ---- knots and control points
  knots_not_increasing,
  knots_wrong_count,      // not as many as control points and degree ask for
  knots_not_clamped,      // ends that do not stand degree + 1 times, or no length between them
  knot_too_often,         // an interior knot that stands more than degree times
  curves_not_compatible,  // different knots or degrees where one set is asked for

  // ---- outlines, boundaries and loops
  not_four_sided,   // an outline with more or fewer than four corners
  corners_apart,    // boundary curves whose ends do not meet
  folded_map,       // the plan map's Jacobian changes sign: (u, v) is not unique
  outside_domain,   // a point to which no (u, v) belongs
  self_crossing,    // an outline or a loop of trim curves touches itself or another
  no_border,        // faces that close on themselves, or lie on each other, and so bound nothing
  open_loop,        // curves that should meet end to end do not
  wrong_way_round,  // a loop that has the face on its right
  off_surface,      // a curve that should lie on the surface does not

  // ---- stripes and the curves through them
  too_few_stripes,     // fewer equations than unknown control points
  coincident_stripes,  // two stripes with one pre-image: they say the same, or contradict each other
  coincident_curves,   // neighbouring curves in one place: no parameter lies between them
  no_length,           // a stripe whose pre-image begins where it ends
  preimage_outside,    // a stripe whose pre-image leaves the surface's domain

  // ---- systems and iterations
  singular,                  // the normal equations have no positive pivot
  empty_cells,               // cells without points, and no fairing to hold the surface there
  span_without_points,       // Schoenberg and Whitney: some control point sees no data of its own
  tolerance_not_met,         // the closest curve there is stays farther off than asked for
  not_converged,             // an iteration that reached its limit
  undetermined_pose,         // a rigid motion that changes no distance
  no_feasible_pose,          // constraints that contradict one another
  singular_parametrization,  // r_u x r_v vanishes: the surface has no tangent plane there
};

std::string_view to_string(Error) noexcept MOLDLOFT_GEOMETRY_NONBLOCKING;

// What is wrong with data, and where: the number of the point, knot, cell, curve or coefficient that the error speaks
// of. The function's header says which.
struct Flaw {
  Error error{};
  std::size_t where = 0;
  bool operator==(const Flaw&) const = default;
};

}  // namespace moldloft::geometry
