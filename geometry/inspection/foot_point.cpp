#include "geometry/inspection/foot_point.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace moldloft::geometry {

namespace {

using Eigen::Vector3d;

constexpr int most_steps = 40;
constexpr double eps = std::numeric_limits<double>::epsilon();
constexpr double certain_mm = 1e-6;  // what a box could hide at the most where the search lets it go

// When a step is the last one.
struct Enough {
  double error_mm;       // of the place it leads to, as far as the steps before foretell it
  double first_rate;     // how the error follows from a step where no step came before; 0: the span's own
  double short_step_mm;  // longer ones are evaluated in any case
};
constexpr Enough exact{1e-13, 10, 1e-4};
constexpr Enough by_distance{1e-6, 0, 0.01};

constexpr double almost_singular = 1e-6;  // of the Hessian, relative to the metric

struct Rectangle {
  double u0, u1, v0, v1;
};

// Half the squared distance to p, seen from one place of the surface: gradient, metric and Hessian.
struct Slope {
  Lanes offset;  // surface - p
  SurfaceJet jet;
  double square;
  double gu, gv;
  double a, b, c;        // first fundamental form
  double huu, huv, hvv;  // Hessian
};

inline Slope slope_of(const SpanPolynomial& span, const Lanes& p, double u, double v) {
  Slope s;
  s.jet = span.at(u, v);
  s.offset = (span.origin - p) + s.jet.value;
  s.square = dot(s.offset, s.offset);
  s.gu = dot(s.offset, s.jet.du), s.gv = dot(s.offset, s.jet.dv);
  s.a = dot(s.jet.du, s.jet.du), s.b = dot(s.jet.du, s.jet.dv), s.c = dot(s.jet.dv, s.jet.dv);
  s.huu = s.a + dot(s.offset, s.jet.duu);
  s.huv = s.b + dot(s.offset, s.jet.duv);
  s.hvv = s.c + dot(s.offset, s.jet.dvv);
  return s;
}

// The minimum of the model g.d + d'Hd / 2 over the rectangle as seen from (u, v), H positive. If the free
// minimum lies outside, the constrained one lies on a bound that the free one breaks.
inline void least_of_model(double huu, double huv, double hvv, double gu, double gv, double u, double v,
                           const Rectangle& r, double& du, double& dv) {
  const double inverse = 1 / (huu * hvv - huv * huv);
  du = (huv * gv - hvv * gu) * inverse;
  dv = (huv * gu - huu * gv) * inverse;
  const double low_u = r.u0 - u, high_u = r.u1 - u, low_v = r.v0 - v, high_v = r.v1 - v;
  const bool out_u = du < low_u || du > high_u, out_v = dv < low_v || dv > high_v;
  if (!out_u && !out_v) return;
  const auto on_u = [&](double at) { return std::clamp(-(gv + huv * at) / hvv, low_v, high_v); };
  const auto on_v = [&](double at) { return std::clamp(-(gu + huv * at) / huu, low_u, high_u); };
  const double side_u = std::clamp(du, low_u, high_u), side_v = std::clamp(dv, low_v, high_v);
  if (out_u && out_v) {
    const auto model = [&](double x, double y) {
      return gu * x + gv * y + 0.5 * (huu * x * x + hvv * y * y) + huv * x * y;
    };
    const double v_there = on_u(side_u), u_there = on_v(side_v);
    if (model(side_u, v_there) <= model(u_there, side_v)) {
      du = side_u, dv = v_there;
    } else {
      du = u_there, dv = side_v;
    }
  } else if (out_u) {
    du = side_u, dv = on_u(side_u);
  } else {
    du = on_v(side_v), dv = side_v;
  }
}

// Where the Hessian is not positive, beyond a centre of curvature, its negative direction is turned round by
// a multiple of the metric: steps stay as long as Newton's, and lead down from a saddle.
inline void step_downhill(const Slope& s, double u, double v, const Rectangle& r, double& du, double& dv) {
  if (!(s.a > 0) || !(s.c > 0)) return;  // a pole, where a direction of the surface vanishes
  const double huu = s.huu / s.a, hvv = s.hvv / s.c, huv = s.huv / std::sqrt(s.a * s.c);
  const double least = 0.5 * (huu + hvv - std::hypot(huu - hvv, 2 * huv));
  const double shift = 0.01 - 2 * std::min(least, 0.0);
  least_of_model(s.huu + shift * s.a, s.huv, s.hvv + shift * s.c, s.gu, s.gv, u, v, r, du, dv);
}

// Where a descent has come to. The last short step is not evaluated any more: (du, dv) lead from where
// `slope` was taken to (u, v), and `offset` and `square` are those of (u, v).
struct Place {
  double u, v;
  Slope slope;
  Lanes offset;
  double square;
  double du = 0, dv = 0;
  int steps = 1;
  bool converged = false;

  Place(double at_u, double at_v, const Slope& s)
      : u(at_u), v(at_v), slope(s), offset(s.offset), square(s.square) {}

  void step_to(double next_u, double next_v, const Slope& s) {
    u = next_u, v = next_v, slope = s, offset = s.offset, square = s.square;
  }
  void expand_to(double next_u, double next_v) {
    du = next_u - u, dv = next_v - v;
    u = next_u, v = next_v;
    const SurfaceJet& jet = slope.jet;
    offset =
        slope.offset + du * (jet.du + 0.5 * du * jet.duu + dv * jet.duv) + dv * (jet.dv + 0.5 * dv * jet.dvv);
    square = dot(offset, offset);
  }
};

inline double moved(double t, double step, double low, double high) {
  return std::clamp(t + step, low, high);
}

// Descends from (u, v) inside the rectangle. `span_of(u, v)` gives the polynomial that holds there.
template <typename SpanOf>
inline Place descend(const Lanes& p, double u, double v, const Rectangle& r, const Enough& enough,
                     const SpanOf& span_of) {
  const SpanPolynomial* span = &span_of(u, v);
  Place place(u, v, slope_of(*span, p, u, v));
  double before = 0;  // squared length of the previous step, mm^2
  while (place.steps < most_steps) {
    const Slope& s = place.slope;
    // Pressed against a bound a parameter stays there, and the other one alone has an equation to solve.
    const bool held_u = (place.u == r.u0 && s.gu > 0) || (place.u == r.u1 && s.gu < 0);
    const bool held_v = (place.v == r.v0 && s.gv > 0) || (place.v == r.v1 && s.gv < 0);
    bool newton = true;
    double du = 0, dv = 0;
    if (held_u || held_v) {
      if (!held_v) {
        newton = s.hvv > almost_singular * s.c;
        dv = std::clamp(-s.gv / (newton ? s.hvv : s.c), r.v0 - place.v, r.v1 - place.v);
      } else if (!held_u) {
        newton = s.huu > almost_singular * s.a;
        du = std::clamp(-s.gu / (newton ? s.huu : s.a), r.u0 - place.u, r.u1 - place.u);
      }
    } else {
      newton = s.huu > 0 && s.huu * s.hvv - s.huv * s.huv > almost_singular * (s.a * s.c);
      if (newton) {
        least_of_model(s.huu, s.huv, s.hvv, s.gu, s.gv, place.u, place.v, r, du, dv);
      } else {
        step_downhill(s, place.u, place.v, r, du, dv);
      }
    }
    const double square = s.a * du * du + 2 * s.b * du * dv + s.c * dv * dv;
    if (!(square > 0)) {
      place.converged = square == 0;
      return place;
    }
    double next_u = moved(place.u, du, r.u0, r.u1), next_v = moved(place.v, dv, r.v0, r.v1);
    const SpanPolynomial* next_span = &span_of(next_u, next_v);

    // Newton's steps shrink like rate * length^2: when the one after this would be below the accuracy, this
    // one is taken on the expansion already at hand, which is good to length^3.
    if (newton && next_span == span && square < enough.short_step_mm * enough.short_step_mm) {
      double rate = enough.first_rate > 0 ? enough.first_rate : 2 * span->newton_rate;
      if (before > 0) rate = std::max(4 * std::sqrt(square) / before, 1e-2);
      if (rate * square < enough.error_mm) {
        place.expand_to(next_u, next_v);
        place.converged = true;
        return place;
      }
    }

    Slope next = slope_of(*next_span, p, next_u, next_v);
    ++place.steps;
    // Of steps too short to be seen in the distance the equations alone can judge.
    const bool unseen = newton && square < 1e-12 + 64 * eps * s.square;
    double share = 1;
    while (!unseen && !(next.square <= s.square) && place.steps < most_steps) {
      share *= 0.5;
      next_u = moved(place.u, share * du, r.u0, r.u1), next_v = moved(place.v, share * dv, r.v0, r.v1);
      next_span = &span_of(next_u, next_v);
      next = slope_of(*next_span, p, next_u, next_v);
      ++place.steps;
    }
    if (!unseen && !(next.square <= s.square)) return place;  // a crease, or not a number
    place.step_to(next_u, next_v, next);
    span = next_span;
    before = newton ? share * share * square : 0;
  }
  return place;
}

FootPoint foot_of(const Place& place, const Lanes& p, const Rectangle& domain) {
  const SurfaceJet& jet = place.slope.jet;
  const double du = place.du, dv = place.dv;
  const Lanes& offset = place.offset;
  const Lanes along_u = jet.du + du * jet.duu + dv * jet.duv;
  const Lanes along_v = jet.dv + du * jet.duv + dv * jet.dvv;
  Lanes normal = cross(along_u, along_v);
  const double length = std::sqrt(dot(normal, normal));
  if (length > 0) normal = (1 / length) * normal;

  FootPoint foot;
  foot.u = place.u, foot.v = place.v;
  foot.point = (p + offset).vector();
  foot.normal = normal.vector();
  foot.distance_mm = std::sqrt(place.square);
  foot.signed_mm = -dot(offset, normal);
  const bool end_u = place.u == domain.u0 || place.u == domain.u1;
  const bool end_v = place.v == domain.v0 || place.v == domain.v1;
  foot.place = end_u && end_v ? FootPlace::corner : end_u || end_v ? FootPlace::side : FootPlace::interior;
  if (end_u || end_v) {
    const Lanes tangential = offset + foot.signed_mm * normal;
    foot.overhang_mm = std::sqrt(dot(tangential, tangential));
  }
  foot.converged = place.converged;
  foot.steps = place.steps;
  return foot;
}

// Without a number to descend on: the place asked for, infinitely far off.
FootPoint no_foot(const PreparedSurface& surface, double u, double v) {
  const SurfacePoint at = surface.at(u, v);
  FootPoint foot;
  foot.u = u, foot.v = v;
  foot.point = at.value;
  const Vector3d across = at.du.cross(at.dv);
  foot.normal = across.norm() > 0 ? across.normalized() : Vector3d::Zero();
  foot.distance_mm = foot.signed_mm = foot.overhang_mm = std::numeric_limits<double>::infinity();
  return foot;
}

Rectangle domain_of(const PreparedSurface& surface) {
  const KnotCells &in_u = surface.along_u(), &in_v = surface.along_v();
  return {in_u.first(), in_u.last(), in_v.first(), in_v.last()};
}

// Branch and bound for one point. `best_` is the nearest place found so far, `least_` the least distance that
// a piece left alone could hide.
class Search {
 public:
  Search(const PreparedSurface& surface, const Vector3d& p, int budget)
      : surface_(surface), p_(p), lanes_(Lanes::of(p)), budget_(budget) {}

  NearestFoot run() {
    const Rectangle domain = domain_of(surface_);
    const Parameters guess = surface_.guess_of(p_);
    take(descend(lanes_, guess.u, guess.v, domain, exact,
                 [&](double u, double v) -> const SpanPolynomial& { return surface_.span_at(u, v); }));
    visit(surface_.levels() - 1, 0, 0);
    NearestFoot nearest{foot_of(best_, lanes_, domain), 0, pieces_};
    nearest.gap_mm = std::max(0.0, distance_ - std::sqrt(least_));
    return nearest;
  }

 private:
  void take(const Place& place) {
    if (!(place.square < best_.square)) return;
    best_ = place;
    distance_ = std::sqrt(place.square);
    // Below this a piece cannot hide anything worth looking at.
    const double short_of = std::max(0.0, distance_ - certain_mm);
    worth_ = short_of * short_of;
  }

  bool worth_looking(double lower_square) {
    if (lower_square < worth_) return true;
    least_ = std::min(least_, lower_square);
    return false;
  }

  bool spend() {
    ++pieces_;
    return pieces_ <= budget_;
  }

  void visit(int level, int i, int j) {
    if (level == 0) return solve_span(i, j);
    struct Child {
      double square;
      int i, j;
    } children[4];
    int count = 0;
    const int last_i = std::min(2 * i + 1, surface_.boxes_u(level - 1) - 1);
    const int last_j = std::min(2 * j + 1, surface_.boxes_v(level - 1) - 1);
    for (int a = 2 * i; a <= last_i; ++a) {
      for (int b = 2 * j; b <= last_j; ++b)
        children[count++] = {surface_.box(level - 1, a, b).squared_distance(p_), a, b};
    }
    for (int k = 1; k < count; ++k) {  // the nearest first: the others may then not be worth a look
      for (int m = k; m > 0 && children[m].square < children[m - 1].square; --m)
        std::swap(children[m], children[m - 1]);
    }
    for (int k = 0; k < count; ++k) {
      if (!worth_looking(children[k].square)) continue;
      if (!spend()) {
        least_ = std::min(least_, children[k].square);
        continue;
      }
      visit(level - 1, children[k].i, children[k].j);
    }
  }

  void solve_span(int i, int j) {
    const KnotCells &in_u = surface_.along_u(), &in_v = surface_.along_v();
    const Rectangle r{in_u.begin_of(i), in_u.end_of(i), in_v.begin_of(j), in_v.end_of(j)};
    const SpanPolynomial& span = surface_.span(i, j);
    const Box& box = surface_.box(0, i, j);
    if (surface_.bounds(i, j).convex_within(reach(box))) return solve_convex(span, r);
    Piece whole{{}, r, 0};
    surface_.bezier_net(i, j, whole.net);
    whole.lower = lower_square(whole.net);
    split(whole, span, 0);
  }

  double reach(const Box& box) const {
    return (p_ - box.low).cwiseAbs().cwiseMax((p_ - box.high).cwiseAbs()).norm();
  }

  // Convex on the rectangle: the tangent plane of half the squared distance lies below it everywhere, and a
  // descent ends at the only minimum.
  void solve_convex(const SpanPolynomial& span, const Rectangle& r) {
    const double u = std::clamp(best_.u, r.u0, r.u1), v = std::clamp(best_.v, r.v0, r.v1);
    const Slope s = slope_of(span, lanes_, u, v);
    const double half_lowest = 0.5 * s.square + std::min(s.gu * (r.u0 - u), s.gu * (r.u1 - u)) +
                               std::min(s.gv * (r.v0 - v), s.gv * (r.v1 - v));
    const double lowest = std::max(0.0, 2 * half_lowest);
    if (!worth_looking(lowest)) return;
    const Place place =
        descend(lanes_, u, v, r, exact, [&](double, double) -> const SpanPolynomial& { return span; });
    take(place);
    if (!place.converged) least_ = std::min(least_, lowest);
  }

  // No point of the net's hull is nearer than its least share along the direction to its middle. Of a piece
  // that faces the point this misses the second order of the piece's size, a box the first.
  double lower_square(const BezierNet& net) const {
    const double by_box = box_of(net).squared_distance(p_);
    const Vector3d towards = 0.25 * (net[1][1] + net[1][2] + net[2][1] + net[2][2]) - p_;
    const double length = towards.norm();
    if (!(length > 0)) return by_box;
    double least = std::numeric_limits<double>::infinity();
    for (const auto& row : net) {
      for (const Vector3d& b : row) least = std::min(least, (b - p_).dot(towards));
    }
    const double by_hull = std::max(0.0, least / length * (1 - 16 * eps));
    return std::max(by_box, by_hull * by_hull);
  }

  struct Piece {
    BezierNet net;
    Rectangle r;
    double lower;
  };

  void split(const Piece& piece, const SpanPolynomial& span, int depth) {
    if (!worth_looking(piece.lower)) return;
    const Rectangle& r = piece.r;
    if (bounds_of(piece.net, r.u1 - r.u0, r.v1 - r.v0).convex_within(reach(box_of(piece.net))))
      return solve_convex(span, r);
    const double middle_u = 0.5 * (r.u0 + r.u1), middle_v = 0.5 * (r.v0 + r.v1);
    if (depth == 0) {  // a descent from here makes the pieces that follow easier to leave alone
      take(descend(lanes_, middle_u, middle_v, r, exact,
                   [&](double, double) -> const SpanPolynomial& { return span; }));
    } else {
      take(Place(middle_u, middle_v, slope_of(span, lanes_, middle_u, middle_v)));
    }
    if (depth >= most_depth || !spend()) {
      least_ = std::min(least_, piece.lower);
      return;
    }
    BezierNet low, high;
    for (int j = 0; j < 4; ++j) halve_along_u(piece.net, low, high, j);
    Piece quarters[4];
    for (int i = 0; i < 4; ++i) {
      halve(low[i], quarters[0].net[i], quarters[1].net[i]);
      halve(high[i], quarters[2].net[i], quarters[3].net[i]);
    }
    int order[4] = {0, 1, 2, 3};
    for (int k = 0; k < 4; ++k) {
      quarters[k].r = {k < 2 ? r.u0 : middle_u, k < 2 ? middle_u : r.u1, k % 2 == 0 ? r.v0 : middle_v,
                       k % 2 == 0 ? middle_v : r.v1};
      quarters[k].lower = lower_square(quarters[k].net);
      for (int m = k; m > 0 && quarters[order[m]].lower < quarters[order[m - 1]].lower; --m)
        std::swap(order[m], order[m - 1]);
    }
    for (const int k : order) split(quarters[k], span, depth + 1);
  }

  static void halve(const Vector3d (&row)[4], Vector3d (&left)[4], Vector3d (&right)[4]) {
    const Vector3d a = 0.5 * (row[0] + row[1]), b = 0.5 * (row[1] + row[2]), c = 0.5 * (row[2] + row[3]);
    const Vector3d d = 0.5 * (a + b), e = 0.5 * (b + c), middle = 0.5 * (d + e);
    left[0] = row[0], left[1] = a, left[2] = d, left[3] = middle;
    right[0] = middle, right[1] = e, right[2] = c, right[3] = row[3];
  }
  static void halve_along_u(const BezierNet& net, BezierNet& low, BezierNet& high, int j) {
    const Vector3d column[4] = {net[0][j], net[1][j], net[2][j], net[3][j]};
    Vector3d left[4], right[4];
    halve(column, left, right);
    for (int i = 0; i < 4; ++i) low[i][j] = left[i], high[i][j] = right[i];
  }

  static Place nowhere() {
    Place place(0, 0, Slope{});
    place.square = std::numeric_limits<double>::infinity();
    return place;
  }

  static constexpr int most_depth = 40;  // halvings of a span: below a part in 1e12

  const PreparedSurface& surface_;
  const Vector3d p_;
  const Lanes lanes_;
  const int budget_;
  Place best_ = nowhere();
  double distance_ = std::numeric_limits<double>::infinity();
  double worth_ = std::numeric_limits<double>::infinity();
  double least_ = std::numeric_limits<double>::infinity();
  int pieces_ = 0;
};

}  // namespace

bool can_be_measured(const Vector3d& p) {
  constexpr double most_mm = 1e100;
  return std::abs(p.x()) <= most_mm && std::abs(p.y()) <= most_mm && std::abs(p.z()) <= most_mm;
}

FootPoint foot_near(const PreparedSurface& surface, const Vector3d& p, double u, double v,
                    FootAccuracy accuracy) {
  const Rectangle domain = domain_of(surface);
  const Lanes lanes = Lanes::of(p);
  u = u > domain.u0 ? std::min(u, domain.u1) : domain.u0;  // also where u is not a number
  v = v > domain.v0 ? std::min(v, domain.v1) : domain.v0;
  if (!can_be_measured(p)) return no_foot(surface, u, v);
  const Enough& enough = accuracy == FootAccuracy::exact ? exact : by_distance;
  const Place place = descend(lanes, u, v, domain, enough, [&](double a, double b) -> const SpanPolynomial& {
    return surface.span_at(a, b);
  });
  return foot_of(place, lanes, domain);
}

NearestFoot nearest_foot(const PreparedSurface& surface, const Vector3d& p, int budget) {
  if (!can_be_measured(p)) {
    const Rectangle domain = domain_of(surface);
    return {no_foot(surface, domain.u0, domain.v0), std::numeric_limits<double>::infinity(), 0};
  }
  return Search(surface, p, budget).run();
}

}  // namespace moldloft::geometry
