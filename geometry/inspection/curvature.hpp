// How a surface bends at a point: fundamental forms, normal, Gaussian, mean, principal
// and absolute curvature.
//
// Source       thesis eq. 2.16, 2.18-2.19 (forms), 2.21 (normal), 2.24 (K, H), 2.25 (principal), figures 6-6
//              and 6-11 (absolute). K, H and the principal curvatures come from the shape operator in an
//              orthonormal tangent basis, not from sqrt(H^2 - K), which loses half the digits near umbilics.
// Signs        the normal is r_u x r_v; a curvature is positive where the surface bends towards it. With x
//              along u, y along v and z up: a bowl is positive, a dome negative, a saddle has K < 0.
//              Exchanging u and v changes the signs of H, k1, k2 (and with them which is larger), never
//              that of K.
// Units        curvatures 1/mm, K 1/mm^2, directions (du, dv) per mm of travel, tangents unit vectors
// Accuracy     k1, k2, H and both entries' difference within 32 eps c B, B = (|r_uu| G + 2 |r_uv| sqrt(EG)
//              + |r_vv| E) / (EG - F^2), c = sqrt(EG / (EG - F^2)), one over the sine between the
//              parameter lines; K within that times |k1| + |k2| + itself. A principal direction within
//              that over k1 - k2 (rad).
// Cost         curvature_at 1.3 times, curvature_map with its evaluation 0.9 times a surface point with all
//              derivatives (38 ns on a quiet machine) a node
// Allocation   curvature_map one row of the control net; the others none
// Failure      Error::singular_parametrization where EG - F^2 ~ 0: the parameter lines meet at less than
//              1e-10 rad, or one stands still (a side drawn together to a point); not_finite; too_few_points
//              and capacity from the map
#pragma once

#include "geometry/error.hpp"
#include "geometry/splines/bspline.hpp"

#include <Eigen/Core>

#include <cmath>
#include <cstddef>
#include <expected>
#include <span>

namespace moldloft::geometry {

struct FundamentalForms {
  double e = 0, f = 0, g = 0;  // first: E = r_u.r_u, F = r_u.r_v, G = r_v.r_v
  double l = 0, m = 0, n = 0;  // second: L = r_uu.N, M = r_uv.N, N = r_vv.N

  // Of the curve that leaves the point towards (du, dv), which must not be (0, 0); its length
  // does not matter.
  double normal_curvature(double du, double dv) const {
    return (l * du * du + 2 * m * du * dv + n * dv * dv) / (e * du * du + 2 * f * du * dv + g * dv * dv);
  }
};

std::expected<FundamentalForms, Error> fundamental_forms(const SurfacePoint&);

struct Curvature {
  double gaussian = 0, mean = 0;
  double k1 = 0, k2 = 0;  // k1 >= k2
  double absolute() const { return std::abs(k1) + std::abs(k2); }

  // Along k1 and k2, in the domain and in space; tangent_1 x tangent_2 is the normal.
  Eigen::Vector2d direction_1 = Eigen::Vector2d::Zero(), direction_2 = Eigen::Vector2d::Zero();
  Eigen::Vector3d tangent_1 = Eigen::Vector3d::Zero(), tangent_2 = Eigen::Vector3d::Zero();
  // Bends alike in all directions, as far as the numbers (or the caller's tolerance) can tell. The directions
  // are then the parameter line v = const and its normal, one choice of many.
  bool umbilic = false;
};

// An umbilic is a point with k1 - k2 <= max(umbilic_tolerance, the accuracy above); tolerance in 1/mm.
std::expected<Curvature, Error> curvature_at(const SurfacePoint&, double umbilic_tolerance = 0);

struct CurvatureSample {
  double gaussian, mean, k1, k2;
  double absolute() const { return std::abs(k1) + std::abs(k2); }
};

// Every node (us[i], vs[j]) into out[i * vs.size() + j]. Nodes without a tangent plane hold NaN; returns how
// many. too_few_points when a direction has no node, capacity when `out` has fewer places than nodes.
std::expected<std::size_t, Error> curvature_map(const BSplineSurface&, std::span<const double> us,
                                                std::span<const double> vs, std::span<CurvatureSample> out);

}  // namespace moldloft::geometry
