#include "geometry/error.hpp"

namespace moldloft::geometry {

std::string_view to_string(Error error) noexcept {
  switch (error) {
    case Error::too_few_points:
      return "too few points for what is asked of them";
    case Error::not_finite:
      return "a number is NaN or infinite";
    case Error::too_large:
      return "a number is too large to calculate with";
    case Error::no_extent:
      return "the points or their domain have no extent in one direction";
    case Error::sizes_differ:
      return "columns that belong together differ in length";
    case Error::impossible_setting:
      return "a setting has a value that makes no sense";
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
    case Error::knots_wrong_count:
      return "the number of knots does not fit the control points and the degree";
    case Error::knots_not_clamped:
      return "the end knots are not clamped, or the domain has no length";
    case Error::knot_too_often:
      return "an interior knot stands more often than the degree allows";
    case Error::repeated_points:
      return "consecutive points lie in one place, or their parameters do not increase";
    case Error::span_without_points:
      return "too few points lie where one of the control points acts";
    case Error::tolerance_not_met:
      return "no curve that was tried comes as close as asked for";
    case Error::corners_apart:
      return "the ends of the boundary curves do not meet";
    case Error::coincident_curves:
      return "neighbouring curves lie in one place";
    case Error::curves_not_compatible:
      return "the curves do not share one knot vector and degree";
    case Error::capacity:
      return "more data than the memory plan holds";
    case Error::empty_cells:
      return "cells of the net hold no points, and no fairing was asked for";
    case Error::negative_weight:
      return "a weight is negative";
    case Error::not_on_plate:
      return "nothing was measured where the plate was expected";
    case Error::too_few_stripes:
      return "too few stripes for so many control points";
    case Error::coincident_stripes:
      return "two stripes lie on the same line of the surface";
    case Error::no_length:
      return "a stripe's pre-image has no length";
    case Error::preimage_outside:
      return "a stripe's pre-image leaves the surface's domain";
    case Error::not_converged:
      return "the iteration did not settle within its limit";
    case Error::undetermined_pose:
      return "the points leave a direction of the pose undetermined";
    case Error::no_feasible_pose:
      return "no pose keeps every point on its side of the surface";
    case Error::singular_parametrization:
      return "the surface's parameter lines touch or stand still, so it has no tangent plane there";
    case Error::self_crossing:
      return "an outline crosses itself or another";
    case Error::no_border:
      return "the faces lie on each other or close on themselves, so no border is left";
    case Error::open_loop:
      return "the curves of an outline do not meet end to end";
    case Error::wrong_way_round:
      return "an outline runs the wrong way round its face";
    case Error::off_surface:
      return "a curve does not lie on the surface it bounds";
  }
  return "unknown error";
}

}  // namespace moldloft::geometry
