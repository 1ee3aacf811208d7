// Formed plates by formula, and their four-sided outlines.
//
// Plate coordinates: origin at the middle of the outline's bounding box, z up, mm. With a, b half the
// bounding box's sides, p = x/a, q = y/b and the amplitude A (10 mm unless given):
//
//     flat       z = 0
//     cylinder   z = sqrt(R^2 - x^2) - R        crown along y; R = 1000 mm unless given
//     saddle     z = A (p^2 - q^2)              -A..A
//     twist      z = A p q                      -A..A, all four corners out of plane
//     dome       z = sqrt(R^2 - x^2 - y^2) - sqrt(R^2 - d^2/2) with d^2 = a^2 + b^2 and a crown 2 A over the corners
//     wave       z = A sin(pi p) cos(pi q / 2)  -A..A
//
// Failure      one line that names the plate and what is impossible about it
#pragma once

#include "host_sim/base/sim_error.hpp"
#include "host_sim/plates/plate.hpp"

#include <expected>
#include <span>
#include <string_view>

namespace moldloft::host_sim {

enum class Shape { flat, cylinder, saddle, twist, dome, wave };
enum class OutlineKind { square, rectangle, trapezoid, parallelogram };

std::span<const std::string_view> shape_names();
std::span<const std::string_view> outline_names();
std::expected<Shape, SimError> shape_named(std::string_view);
std::expected<OutlineKind, SimError> outline_named(std::string_view);

// Lengths of 0 take the kind's default, chosen to fit under the SCARA arm like the thesis's plate of 305 x 305 mm:
// rectangle 305 x 229, trapezoid 305 below, 229 above, 254 deep, parallelogram 244 x 244 sheared by 61.
struct OutlineSizes {
  double width_mm = 0;      // along x, the lower side
  double depth_mm = 0;      // along y
  double top_width_mm = 0;  // trapezoid: the upper side, centred over the lower one
  double shear_mm = 0;      // parallelogram: how far the upper side is shifted along x
};

// Four corners, counter-clockwise from the lower left, the middle of the bounding box at the origin.
std::array<Eigen::Vector2d, 4> outline_corners(OutlineKind, const OutlineSizes&);

struct PlateDescription {
  Shape shape = Shape::saddle;
  std::array<Eigen::Vector2d, 4> corners = outline_corners(OutlineKind::square, {});
  double thickness_mm = 6;
  double amplitude_mm = 10;
  double radius_mm = 1000;  // of the cylinder
};

// Any convex quadrilateral may be the outline.
std::expected<std::shared_ptr<const Plate>, SimError> make_plate(const PlateDescription&);

}  // namespace moldloft::host_sim
