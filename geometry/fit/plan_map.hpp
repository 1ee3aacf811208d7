// The plan map X(u, v) = (x, y): the bilinearly blended Coons patch of the outline's four sides (thesis eq.
// 2.65), and its inverse. The plate is explicit (z over x, y), so a point's parameters are those of its plan
// position: safe where projecting on a wavy base surface is not (fit/README.md, figures of the wave).
//
// Outside [0, 1]^2 the sides go on along their end tangents.
//
// u runs along sides[0] (corner 0 to corner 1), v along sides[3] reversed (corner 0 to corner 3).
//
// Accuracy     the inverse satisfies |X(u, v) - (x, y)| <= 1e-10 mm
// Cost         a point with a neighbour's (u, v) as guess: 2-3 Newton steps, about 0.1 us; in batches of
//              neighbours 10-20 ns a point
// Allocation   none in invert(); the constructor copies four curves
// Failure      from check() Error::folded_map, collinear (a corner whose sides do not turn) or
//              not_finite; outside_domain from invert() when the point lies off the plate by more than
//              the margin asked for
// Expects      sides that share one uniform clamped knot vector, as OutlineBuilder makes them
#pragma once

#include "geometry/edges/outline.hpp"
#include "geometry/nonblocking.hpp"
#include "geometry/simd.hpp"

#include <Eigen/Core>

#include <array>
#include <expected>
#include <span>
#include <vector>

namespace moldloft::geometry {

struct PlanPoint {
  Eigen::Vector2d value;
  Eigen::Matrix2d jacobian;  // columns dX/du, dX/dv
};

class PlanMap {
 public:
  explicit PlanMap(int spans = OutlineSettings{}.spans);  // has room for sides of so many spans
  explicit PlanMap(const Outline& outline);
  void assign(const Outline& outline)
      MOLDLOFT_GEOMETRY_NONBLOCKING;  // without allocation while there is room

  PlanPoint at(double u, double v) const;
  std::expected<void, Error> check() const
      MOLDLOFT_GEOMETRY_NONBLOCKING;  // Jacobian positive on a 65 x 65 grid
  // The same in pieces: rows 0 to check_rows - 1, 10 us each.
  static constexpr int check_rows = 65;
  std::expected<void, Error> check_row(int row) const MOLDLOFT_GEOMETRY_NONBLOCKING;
  // (u, v) of a plan position, starting from `guess`; outside [0, 1]^2 by at most `margin` it is still given.
  std::expected<Eigen::Vector2d, Error> invert(const Eigen::Vector2d& xy, const Eigen::Vector2d& guess,
                                               double margin = 0.0) const;

  // The same for a batch of neighbours, such as a stripe: u[k], v[k] for every x[k], y[k], eight at a time.
  // A point that has none gets NaN. `guess` is that of the first point and is left at the last one's. Bits
  // do not depend on the machine's vector unit. Returns how many points have none.
  std::size_t invert(std::span<const double> x, std::span<const double> y, std::span<double> u,
                     std::span<double> v, Eigen::Vector2d& guess, double margin = 0.0,
                     Simd = widest_simd()) const;

  const Outline& outline() const { return outline_; }

  // The map as a bicubic B-spline net over knots that contain the sides' knots: exact, since every blend is
  // bilinear in splines of degree 3. Fills x and y of `surface` for its knot vectors.
  void to_net(BSplineSurface& surface) const;

 private:
  void tabulate();
  // One span of two opposite sides as polynomials in the span's own coordinate, power basis.
  struct SpanPair {
    double coefficient[4][4];  // [low x, low y, high x, high y][power]
  };
  struct PairValue {
    Eigen::Vector2d low, high, low_first, high_first;
  };
  bool invert_eight(const double* x, const double* y, double* u, double* v, const Eigen::Vector2d& guess,
                    Simd simd) const;
  static PairValue evaluate(const std::vector<SpanPair>&, double t);

  Outline outline_;
  std::vector<SpanPair> along_u_, along_v_;  // low and high: v = 0 and 1; u = 0 and 1
  Eigen::Vector2d c00_, c10_, c01_, c11_;
};

}  // namespace moldloft::geometry
