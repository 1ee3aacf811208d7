// The bilinear Coons patch of four boundary curves in space (thesis eq. 2.65), evaluated as it is defined,
// and the same surface as a B-spline net (eq. 2.66-2.69).
//
// The net blends the boundary nets at the Greville abscissae, where a straight line at unit speed has its
// control points; equal steps, as the thesis prints them in (2.69), are the same for Bezier curves and wrong
// for any other.
//
// Units        millimetres; u and v in [0, 1], the curves' own parameters are stretched to that
// Accuracy     the net agrees with the definition within 16 (p + q + knots inserted) eps of
//              the largest coordinate
// Cost         a point: four curve points; the net: 12 flops and two curve refinements a control point
// Allocation   none in at(); what is returned elsewhere
// Failure      what check() finds in a curve, with the side in the order of CoonsSides; corners_apart with the
//              corner, in the order (0, 0), (1, 0), (0, 1), (1, 1)
#pragma once

#include "geometry/error.hpp"
#include "geometry/splines/bspline.hpp"

#include <array>
#include <expected>

namespace moldloft::geometry {

// The sides of a four-sided patch, each running the way its parameter does.
struct CoonsSides {
  SpaceCurve low_v;   // along u at v = 0
  SpaceCurve high_v;  // along u at v = 1
  SpaceCurve low_u;   // along v at u = 0
  SpaceCurve high_u;  // along v at u = 1
};

class CoonsPatch {
 public:
  // Ends may miss each other by `gap_mm`; the corner then lies halfway between them, and the patch keeps its
  // sides only that well.
  static std::expected<CoonsPatch, Flaw> through(CoonsSides sides, double gap_mm = 1e-6);

  SurfacePoint at(double u, double v) const;

  // Degrees are the higher of either pair's (at least 1), knots the union of either pair's.
  BSplineSurface net() const;

  const CoonsSides& sides() const { return sides_; }
  const std::array<Eigen::Vector3d, 4>& corners() const { return corners_; }

 private:
  CoonsSides sides_;
  std::array<Eigen::Vector3d, 4> corners_;
};

}  // namespace moldloft::geometry
