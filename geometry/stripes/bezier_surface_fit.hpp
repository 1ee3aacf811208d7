// One Bezier patch of any degree through Bezier stripes with straight pre-images (thesis section 3.2, eq.
// 3.1-3.14), with or without its boundary given (eq. 3.40).
//
// The thesis's first method, kept as what it is: every control point reaches everywhere, and the
// condition of the matrix grows about tenfold with every second degree. Up to degree 10 or so it
// serves; at degree 24 the normal equations are no longer positive definite and even QR loses ten
// digits. For work: bspline_surface_fit.hpp.
//
// Shapes       control point (i, j) of the net in row i (degree_v + 1) + j, columns x, y, z
// Units        mm in, mm out; the pre-images lie in [0, 1]^2
// Accuracy     a surface of these degrees, its stripes exact, comes back within unknowns condition eps of its
//              size, by normal equations within unknowns condition^2 eps
// Cost         (degree_u + 1)^2 (degree_v + 1)^2 a stripe for the matrix; 2 rows unknowns^2 to solve by QR, a
//              quarter of it by normal equations
// Allocation   the matrix, a copy to factor, the result
// Failure      MatchingFailure: not_finite, no_length, preimage_outside, coincident_stripes, too_few_stripes,
//              too_few_points (a stripe whose degree is above the surface's), singular (with the
//              condition if by QR)
#pragma once

#include "geometry/stripes/matching_failure.hpp"

#include <Eigen/Core>

#include <expected>
#include <span>

namespace moldloft::geometry {

struct BezierStripe {
  Eigen::MatrixX3d control;  // degree + 1 control points, degree at most degree_u + degree_v
  Eigen::Vector2d from, to;  // the ends of its straight pre-image
};

enum class LeastSquares { qr, normal_equations };

struct BezierFitSettings {
  int degree_u = 3, degree_v = 3;
  LeastSquares method = LeastSquares::qr;
  // (degree_u + 1)(degree_v + 1) x 3, of which the outer ring is kept; without rows the ring is unknown too.
  Eigen::MatrixX3d boundary{};
};

struct BezierSurfaceFit {
  Eigen::MatrixX3d control;
  int equations = 0, unknowns = 0;
  double condition =
      1;  // of the matrix in the 2-norm, estimated from below by inverse iteration (within 2 in practice)
  double rms_mm = 0, max_mm = 0;  // of the equations
};

// Fills [a] of equation (3.14): degree_u + degree_v + 1 rows a stripe. Allocates only when `matrix`
// has another size.
void matching_matrix(int degree_u, int degree_v, std::span<const BezierStripe>, Eigen::MatrixXd& matrix);

std::expected<BezierSurfaceFit, MatchingFailure> fit_bezier_surface(std::span<const BezierStripe>,
                                                                    const BezierFitSettings&);

}  // namespace moldloft::geometry
