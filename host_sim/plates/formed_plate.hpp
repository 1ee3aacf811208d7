// A plate that was to become one shape and became another, by mistakes that are known: the truth of an inspection.
//
//     wave, springback 0.9, twist 3 mm, bow 2 mm, dent 5 mm at 100,80, dent -2 mm at 0,0 radius 60
//
// In plate coordinates, with p, q running from -1 to 1 over the outline's bounding box:
//
//     SHAPE           what it was formed to, when that is another one than the design
//     springback F    all heights times F
//     twist T mm      T/4 p q: one corner stands T out of the plane of the other three
//     shift X,Y mm    the formed shape lies X, Y beside its place within the outline, which stays (up to 100 mm)
//     bow B mm        B p^2: the ends across x stand B over the middle
//     dent D mm at X,Y [radius R]   down by D at (X, Y), as (1 - (r/R)^2)^3, none from R (40 mm) on; below 0: a bump
//
// Failure      one line: which word, and what is known
#pragma once

#include "geometry/rigid_motion.hpp"
#include "geometry/splines/bspline.hpp"
#include "host_sim/plates/plate_shape.hpp"

#include <expected>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace moldloft::host_sim {

struct Dent {
  double depth_mm = 0, x_mm = 0, y_mm = 0, radius_mm = 40;
};

struct Mistakes {
  std::optional<Shape> shape;
  double springback = 1, twist_mm = 0, bow_mm = 0, shift_x_mm = 0, shift_y_mm = 0;
  std::vector<Dent> dents = {};
};

std::expected<Mistakes, SimError> mistakes_from(std::string_view text);
std::string words_of(
    const Mistakes&);  // which mistakes_from() reads as the same; empty of a plate without any

// Heights of the one less those of the other, at one place each, over a grid inside the outline: nothing is aligned.
struct HeightDifference {
  double rms_mm = 0, lowest_mm = 0, highest_mm = 0;
};
HeightDifference height_difference(const Plate& formed, const Plate& design);

// The plate with the mistakes in it. Dents must lie in the outline's bounding box.
std::expected<std::shared_ptr<const Plate>, SimError> make_formed_plate(std::shared_ptr<const Plate>,
                                                                        const Mistakes&);

// A four-sided plate as a bicubic surface over its outline, through the plate at some thousand places: within 1e-4 mm
// of formulas, on the corners and the straight sides exactly.
geometry::BSplineSurface spline_of(const Plate&,
                                   const geometry::RigidMotion& placed = geometry::RigidMotion::Identity());

}  // namespace moldloft::host_sim
