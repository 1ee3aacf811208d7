// A four-sided carrier for outlines that are not four-sided: the rectangle of least area round the
// outline, as an Outline for PlanMap, and the outline itself in the (u, v) of that rectangle, to trim the
// fitted surface with.
//
// The rectangle has straight sides at constant speed, so the plan map is affine, and the outline's control
// points are mapped exactly. It is no larger than the outline's own extent, but for 1e-9 of it (and
// `margin_mm` where asked for). What lies between the outline and the rectangle's sides holds no data of the
// plate: the surface there comes from the fit's fairing alone, is trimmed away, and `covered` says how much
// of the rectangle is left. A scan also sees what lies beside the plate, and the map takes all of the
// rectangle: the caller gives the fit only points that are inside().
//
// Source       least rectangle: one of its sides lies along an edge of the convex hull (Freeman
//              and Shapira 1975)
// Frame        world, plan view, mm; outlines in either direction (turned counter-clockwise)
// Accuracy     extents exact to rounding (roots of the pieces' derivatives); the rectangle's direction is the
//              best for the outline cut into chords, whose area is within 1e-3 of the least one for smooth
//              sides; inside() knows the outline within `chord_mm`
// Cost         O(n^2) in the chords, for the check of crossings; inside() O(n)
// Allocation   yes
// Failure      too_few_points: fewer than three different points; not_finite; collinear: no area;
//              self_crossing; open_loop: sides that do not meet within 1e-6 mm; knots_not_increasing: a side
//              that is not clamped
#pragma once

#include "geometry/edges/outline.hpp"
#include "geometry/splines/trimmed_surface.hpp"

#include <expected>
#include <span>
#include <vector>

namespace moldloft::geometry {

struct CarrierSettings {
  double corner_angle = 0.5;  // rad: where a polyline turns by more than this, two sides meet
  double margin_mm = 0;       // between outline and rectangle
  double chord_mm = 1e-3;     // how far the chords that inside() knows may lie off the outline
};

struct Carrier {
  Outline outline;                      // the rectangle; u runs within 45 degrees of the world's x
  TrimLoop trim;                        // the outline in (u, v), counter-clockwise, one curve a side
  double covered = 0;                   // the outline's area over the rectangle's
  std::vector<Eigen::Vector2d> chords;  // the outline, world

  bool inside(const Eigen::Vector2d& xy) const;
};

// From smooth sides, joined end to end in their order. One closed side will do.
std::expected<Carrier, Error> carrier_of(std::span<const PlanCurve> sides, const CarrierSettings& = {});

// From a closed polyline: smooth_sides.hpp says how it is read.
std::expected<Carrier, Error> carrier_of(std::span<const Eigen::Vector2d> polyline,
                                         const CarrierSettings& = {});

}  // namespace moldloft::geometry
