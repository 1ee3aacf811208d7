// One knot span of a bicubic surface as a polynomial, and its value with all first and second derivatives.
//
// Form         sum_ij c[j][i] s^i t^j with s = u - middle_u, t = v - middle_v, added to `origin` (a
//              control point of the span). The coefficients are as small as the span, not as the surface,
//              so that a difference to a point near by keeps its digits however far from the frame's
//              origin the plate lies
// Frame        the surface's, mm; s and t in units of the knots
// Accuracy     8 eps times the span's extent, derivatives relative to theirs (prepared_surface.hpp)
// Cost         38 multiply-adds on x, y, z at once; a vector is two pairs of doubles, which every
//              64-bit target has
// Determinism  no operation depends on the target: the same bits everywhere
// Allocation   none
#pragma once

#include <Eigen/Core>

namespace moldloft::geometry {

using Pair = double __attribute__((vector_size(16)));

// x, y, z and a zero.
struct Lanes {
  Pair xy, z0;

  static Lanes of(const Eigen::Vector3d& p) { return {Pair{p.x(), p.y()}, Pair{p.z(), 0}}; }
  Eigen::Vector3d vector() const { return {xy[0], xy[1], z0[0]}; }
};

inline Lanes operator+(const Lanes& a, const Lanes& b) { return {a.xy + b.xy, a.z0 + b.z0}; }
inline Lanes operator-(const Lanes& a, const Lanes& b) { return {a.xy - b.xy, a.z0 - b.z0}; }
inline Lanes operator*(double f, const Lanes& a) { return {f * a.xy, f * a.z0}; }
inline double dot(const Lanes& a, const Lanes& b) {
  const Pair sum = a.xy * b.xy + a.z0 * b.z0;
  return sum[0] + sum[1];
}
inline Lanes cross(const Lanes& a, const Lanes& b) {
  return {Pair{a.xy[1] * b.z0[0] - a.z0[0] * b.xy[1], a.z0[0] * b.xy[0] - a.xy[0] * b.z0[0]},
          Pair{a.xy[0] * b.xy[1] - a.xy[1] * b.xy[0], 0}};
}

struct SurfaceJet {
  Lanes value;  // relative to the span's origin
  Lanes du, dv, duu, duv, dvv;
};

struct SpanPolynomial {
  Lanes c[4][4];
  Lanes origin;
  double middle_u = 0, middle_v = 0;
  // How fast Newton's steps to a foot on the span shrink at least: the next is about rate * length^2, in mm.
  // From the first two derivatives; what curvature changes does at a distance is not in it.
  double newton_rate = 0;

  SurfaceJet at(double u, double v) const {
    const double s = u - middle_u, t = v - middle_v;
    Lanes value[4], first[4], second[4];  // of the four cubics in s; `second` is half the second derivative
#pragma GCC unroll 4
    for (int j = 0; j < 4; ++j) {
      const Lanes* p = c[j];
      const Lanes a2 = p[2] + s * p[3], a1 = p[1] + s * a2;
      const Lanes b2 = a2 + s * p[3];
      value[j] = p[0] + s * a1;
      first[j] = a1 + s * b2;
      second[j] = b2 + s * p[3];
    }
    SurfaceJet jet;
    const Lanes a2 = value[2] + t * value[3], a1 = value[1] + t * a2;
    const Lanes b2 = a2 + t * value[3];
    jet.value = value[0] + t * a1;
    jet.dv = a1 + t * b2;
    jet.dvv = 2.0 * (b2 + t * value[3]);
    const Lanes d2 = first[2] + t * first[3], d1 = first[1] + t * d2;
    jet.du = first[0] + t * d1;
    jet.duv = d1 + t * (d2 + t * first[3]);
    jet.duu = 2.0 * (second[0] + t * (second[1] + t * (second[2] + t * second[3])));
    return jet;
  }
};

}  // namespace moldloft::geometry
