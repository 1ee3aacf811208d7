// A face: a B-spline surface and the closed loops of curves in its (u, v) that bound it.
//
// Orientation  the face's normal is du x dv. Seen against the normal (from the side it points to) the face
//              lies to the left of every loop: the outer loop runs counter-clockwise in (u, v), holes run
//              clockwise. A curve that is stored the other way round says so by `reversed`.
// Border       an empty outer loop stands for the natural border, the rectangle of the knots
// Images       a curve may carry its image in space: over the same parameter, and within `tolerance_mm`
//              of the surface
// Units        (u, v) without unit, inside the surface's knots; images in mm
// Cost         check: 16 points a span of every curve, then O(n^2) for the crossings of the n chords
// Allocation   yes
// Failure      check() names what is wrong: see there
#pragma once

#include "geometry/error.hpp"
#include "geometry/splines/bspline.hpp"

#include <expected>
#include <optional>
#include <vector>

namespace moldloft::geometry {

struct TrimCurve {
  PlanCurve path;                        // (u, v)
  std::optional<SpaceCurve> image = {};  // surface(path), where it is known
  bool reversed = false;                 // the loop walks the path from its end to its start
};
using TrimLoop = std::vector<TrimCurve>;

struct TrimmedSurface {
  BSplineSurface surface;
  TrimLoop outer = {};
  std::vector<TrimLoop> holes = {};
};

// The natural border as a loop of four curves, v = v0, u = u1, v = v1 (reversed), u = u0 (reversed).
// Their images are the outer rows and columns of the control net, bit for bit: a clamped surface
// interpolates them exactly.
TrimLoop natural_border(const BSplineSurface&);

PlanCurve reversed(const PlanCurve&);
SpaceCurve reversed(const SpaceCurve&);

// The cubic spline over `parameter` (increasing) that has the given values and slopes there;
// double knots, C1.
template <typename Vector>
std::vector<Vector> hermite_control(const std::vector<double>& parameter, const std::vector<Vector>& value,
                                    const std::vector<Vector>& slope);
std::vector<double> hermite_knots(const std::vector<double>& parameter);

// The image of a path on the surface as a cubic spline over the path's own parameter, C1, no farther from
// surface(path(t)) at any t than `tolerance_mm` (below 1e-9 mm it is taken as 1e-9 mm). Hermite pieces,
// halved until they fit: the error of a piece is (h^4 / 384) max |f''''| at most, it is measured at 15 points
// of the piece and must stay below half the tolerance there. The image meets the surface exactly at its ends.
SpaceCurve image_on(const BSplineSurface&, const PlanCurve& path, double tolerance_mm);

// The loop as chords of its curves, in the direction in which it is walked: `chords_a_span` for
// every knot span.
std::vector<Eigen::Vector2d> chords(const TrimLoop&, int chords_a_span = 16);

// not_finite: NaN or infinity anywhere. knots_not_increasing: knots that decrease, or that do not fit their
// control points. too_few_points: a net or curve with fewer than four control points, a hole without curves.
// open_loop: ends more than 1e-9 apart in (u, v). outside_domain: a loop leaves the surface's knots by more
// than 1e-12. wrong_way_round: an outer loop that runs clockwise, a hole that runs counter-clockwise or lies
// outside the face. self_crossing: loops that cross themselves or each other. off_surface: an image farther
// than the tolerance from the surface, or over another parameter.
std::expected<void, Error> check(const TrimmedSurface&, double tolerance_mm);

}  // namespace moldloft::geometry
