// A bicubic surface made ready for many questions: every knot span as a polynomial, boxes round the spans for
// searches, and where the surface is explicit (z over x, y) a plan-view table of first guesses.
//
// Domain       [first_u, last_u] x [first_v, last_v]; parameters outside are moved onto its border
// Accuracy     at() agrees with BSplineSurface::at within 32 eps of the control net's size, derivatives of
//              order k within 64 eps of that size over (shortest span)^k; boxes contain their span. A
//              plan-view guess is exact to rounding where x and y are linear in u and v, elsewhere off by the
//              second order of a table cell
// Cost         at() about 40 ns; built in 16 x 6 multiply-adds a span, 0.5 ms for 20 x 20 spans
// Memory       about 0.8 kB a span and 16 B a table node; bytes() says it
// Allocation   in from() only; every other call is const, touches no heap and may run in several
//              threads at once
// Failure      Error::knots_not_increasing, not_finite, too_few_points (a net smaller than 4 x 4, or one that
//              does not fit its knots)
#pragma once

#include "geometry/error.hpp"
#include "geometry/inspection/span_polynomial.hpp"
#include "geometry/splines/bspline.hpp"
#include "geometry/splines/knot_cells.hpp"

#include <cstddef>
#include <expected>
#include <span>
#include <vector>

namespace moldloft::geometry {

struct Box {
  Eigen::Vector3d low, high;
  double squared_distance(const Eigen::Vector3d& p) const;  // 0 inside
};

struct Parameters {
  double u = 0, v = 0;
};

// What a search must know of a span beyond its box: bounds on the derivatives, from their control points.
struct SpanBounds {
  double least_du2 = 0, least_dv2 = 0;  // of |du|^2 and |dv|^2
  double most_du_dv = 0;                // of |du . dv|
  double most_duu = 0, most_duv = 0, most_dvv = 0;

  // The squared distance to any point within `reach` of all of the span is strictly convex in (u, v).
  bool convex_within(double reach) const {
    const double huu = least_du2 - reach * most_duu, hvv = least_dv2 - reach * most_dvv;
    const double huv = most_du_dv + reach * most_duv;
    return huu > 0 && hvv > 0 && huu * hvv > huv * huv;
  }
};

// Control points of a bicubic Bezier patch, rows along u; bounds of it.
using BezierNet = Eigen::Vector3d[4][4];
Box box_of(const BezierNet&);
SpanBounds bounds_of(const BezierNet&, double width_u, double width_v);

class PreparedSurface {
 public:
  static std::expected<PreparedSurface, Error> from(const BSplineSurface&);

  SurfacePoint at(double u, double v) const;
  bool is_explicit() const {
    return !plan_.empty();
  }  // its plan view does not fold, so guess_of() is a table

  // Where to start for a point near the surface: by the plan view where the surface is explicit, else the
  // middle of the span whose box is nearest in a descent through the boxes.
  Parameters guess_of(const Eigen::Vector3d& p) const;

  const KnotCells& along_u() const { return along_u_; }
  const KnotCells& along_v() const { return along_v_; }
  const SpanPolynomial& span(int i, int j) const { return spans_[index(i, j)]; }
  const SpanPolynomial& span_at(double u, double v) const {
    return span(along_u_.locate(u), along_v_.locate(v));
  }
  const SpanBounds& bounds(int i, int j) const { return bounds_[index(i, j)]; }
  void bezier_net(int i, int j, BezierNet& net) const;

  // Boxes by level: level 0 one a span, each next level one for 2 x 2 of the one below, the last one for all.
  int levels() const { return static_cast<int>(levels_.size()); }
  int boxes_u(int level) const { return levels_[static_cast<std::size_t>(level)].count_u; }
  int boxes_v(int level) const { return levels_[static_cast<std::size_t>(level)].count_v; }
  const Box& box(int level, int i, int j) const {
    const Level& l = levels_[static_cast<std::size_t>(level)];
    return boxes_[l.first + static_cast<std::size_t>(i) * static_cast<std::size_t>(l.count_v) +
                  static_cast<std::size_t>(j)];
  }
  std::size_t bytes() const;

 private:
  struct Level {
    std::size_t first;
    int count_u, count_v;
  };
  std::size_t index(int i, int j) const {
    return static_cast<std::size_t>(i) * static_cast<std::size_t>(along_v_.count()) +
           static_cast<std::size_t>(j);
  }
  void build_spans(const BSplineSurface&);
  void build_boxes();
  void build_plan(const BSplineSurface&);
  Parameters plan_guess(double x, double y) const;
  Parameters descended_guess(const Eigen::Vector3d& p) const;

  KnotCells along_u_, along_v_;
  std::vector<SpanPolynomial> spans_;
  std::vector<SpanBounds> bounds_;
  std::vector<Box> boxes_;
  std::vector<Level> levels_;
  std::vector<Parameters> plan_;  // (u, v) at the nodes of a grid over the plan view's bounding rectangle
  int plan_u_ = 0, plan_v_ = 0;
  double plan_x_ = 0, plan_y_ = 0, per_x_ = 0, per_y_ = 0;
};

}  // namespace moldloft::geometry
