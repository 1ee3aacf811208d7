// The foot of a point on a surface: the place nearest to it, near a guess or over the whole surface.
//
// Method       Newton on (r - p) . r_u = (r - p) . r_v = 0 with second derivatives (as Piegl and Tiller, The
//              NURBS Book, 6.1, but as a minimization): every step solves the quadratic model on the
//              parameter rectangle exactly, is taken only as far as it gets nearer, and on a Hessian shifted
//              until it is positive where it is not. The global search is branch and bound over the boxes of
//              the Bezier patches, cut finer until the squared distance is convex on each piece that is left
// Frame        the surface's, mm
// Border       a point whose nearest place is on the border gets that place: `side` or `corner` says so,
//              overhang_mm how far the point stands beyond. A foot exactly on the border with nothing beyond
//              is classed `side`, too
// Sign         signed_mm is (p - point) . normal, normal = r_u x r_v normalized: positive on the side to
//              which the normal points, which for a plate with u along x and v along y is up
// Accuracy     interior: |(point - p) . r_u| / |r_u| and the same along v <= 1e-12 mm for plates within 1e4
//              mm of the origin and points up to 20 mm off; farther off a few eps of the distance
// Cost         with a guess 0.1..0.25 us; global 1..3 us near a plate
// Allocation   none
// Failure      foot_near: `converged` is false after 40 steps, or on a crease (a knot of multiplicity 3 or
//              more), where the equations have no solution. It finds a local minimum, never a place farther
//              away than the guess's
//              nearest_foot: gap_mm, see below
//              both: of a point that cannot be measured (can_be_measured()) `converged` is false, and
//              distances and gap are infinite
#pragma once

#include "geometry/inspection/prepared_surface.hpp"

#include <Eigen/Core>

#include <cstdint>

namespace moldloft::geometry {

enum class FootPlace : std::uint8_t { interior, side, corner };

struct FootPoint {
  double u = 0, v = 0;
  Eigen::Vector3d point, normal;
  double distance_mm = 0;
  double signed_mm = 0;  // in the interior +- distance_mm
  double overhang_mm =
      0;  // what is left of p - point in the tangent plane: 0 in the interior but for rounding
  FootPlace place = FootPlace::interior;
  bool converged = false;
  int steps = 0;  // surface evaluations
};

// How near to the true foot: `exact` as stated above; `by_distance` within 1e-6 mm along the surface, which
// leaves distances of a plate right to 1e-11 mm (they are least there) and saves a step.
enum class FootAccuracy : std::uint8_t { exact, by_distance };

// Every coordinate is a number within 1e100 mm, so that a double holds the square of its distance.
bool can_be_measured(const Eigen::Vector3d& p);

// The local foot that descends from (u, v).
FootPoint foot_near(const PreparedSurface&, const Eigen::Vector3d& p, double u, double v,
                    FootAccuracy accuracy = FootAccuracy::exact);

struct NearestFoot {
  FootPoint foot;
  // No place of the surface is nearer than foot.distance_mm - gap_mm. At most 1e-6 mm, unless the search ran
  // out of its budget of pieces: near the centre of a sphere every place is as near as any other.
  double gap_mm = 0;
  int pieces = 0;  // boxes looked at
};

// The nearest of all. `budget` bounds the pieces, and so the time: about 1 us each at the worst.
NearestFoot nearest_foot(const PreparedSurface&, const Eigen::Vector3d& p, int budget = 100'000);

}  // namespace moldloft::geometry
