#include "geometry/fit/smooth_sides.hpp"

#include "geometry/splines/closed_polygon.hpp"

#include <algorithm>
#include <cmath>

namespace moldloft::geometry {

namespace {

using Eigen::Vector2d;
using Points = std::vector<Vector2d>;

// A tridiagonal system: lower x[i-1] + diagonal x[i] + upper x[i+1] = right.
struct Row {
  double lower = 0, diagonal = 1, upper = 0;
  Vector2d right = Vector2d::Zero();
};

// Without exchange of rows: every row below is dominated by its diagonal, or is so after the first step.
Points solved(std::vector<Row> rows) {
  for (std::size_t i = 1; i < rows.size(); ++i) {
    const double factor = rows[i].lower / rows[i - 1].diagonal;
    rows[i].diagonal -= factor * rows[i - 1].upper;
    rows[i].right -= factor * rows[i - 1].right;
  }
  Points x(rows.size());
  for (std::size_t i = rows.size(); i-- > 0;) {
    x[i] = rows[i].right;
    if (i + 1 < rows.size()) x[i] -= rows[i].upper * x[i + 1];
    x[i] /= rows[i].diagonal;
  }
  return x;
}

struct Chords {
  std::vector<double> length;
  Points slope;  // of each chord, over its length
};

Chords chords_of(const Points& p) {
  Chords c;
  for (std::size_t i = 0; i + 1 < p.size(); ++i) {
    c.length.push_back((p[i + 1] - p[i]).norm());
    c.slope.push_back((p[i + 1] - p[i]) / c.length.back());
  }
  return c;
}

// Second derivatives agree at an inner point whose chords are `before` and `after`.
Row smooth_at(const Chords& c, std::size_t before, std::size_t after) {
  const double h0 = c.length[before], h1 = c.length[after];
  return {h1, 2 * (h0 + h1), h0, 3 * (h1 * c.slope[before] + h0 * c.slope[after])};
}

// Not-a-knot: the third derivatives agree at the point next to the end.
Row at_start(double h0, double h1, const Vector2d& s0, const Vector2d& s1) {
  const double sum = h0 + h1;
  return {0, h1, sum, ((h0 + 2 * sum) * h1 * s0 + h0 * h0 * s1) / sum};
}

Points open_slopes(const Points& p) {
  const Chords c = chords_of(p);
  const std::size_t n = p.size();
  if (n == 2) return {c.slope[0], c.slope[0]};
  if (n == 3) {
    const Vector2d bend = (c.slope[1] - c.slope[0]) / (c.length[0] + c.length[1]);
    return {c.slope[0] - c.length[0] * bend, c.slope[0] + c.length[0] * bend,
            c.slope[1] + c.length[1] * bend};
  }
  std::vector<Row> rows;
  rows.push_back(at_start(c.length[0], c.length[1], c.slope[0], c.slope[1]));
  for (std::size_t i = 1; i + 1 < n; ++i) rows.push_back(smooth_at(c, i - 1, i));
  Row last = at_start(c.length[n - 2], c.length[n - 3], c.slope[n - 2], c.slope[n - 3]);
  std::swap(last.lower, last.upper);
  rows.push_back(last);
  return solved(std::move(rows));
}

// The first point is given again at the end. The cyclic system by the Sherman-Morrison formula.
Points closed_slopes(const Points& p) {
  const Chords c = chords_of(p);
  const std::size_t n = p.size() - 1;
  std::vector<Row> rows;
  for (std::size_t i = 0; i < n; ++i) rows.push_back(smooth_at(c, i == 0 ? n - 1 : i - 1, i));
  const double corner_up = rows.front().lower, corner_down = rows.back().upper,
               gamma = -rows.front().diagonal;
  rows.front().diagonal -= gamma;
  rows.back().diagonal -= corner_up * corner_down / gamma;
  std::vector<Row> correction = rows;
  for (Row& row : correction) row.right.setZero();
  correction.front().right.setConstant(gamma);
  correction.back().right.setConstant(corner_down);
  Points x = solved(std::move(rows));
  const Points z = solved(std::move(correction));
  const double share = corner_up / gamma;
  const Vector2d factor = (x.front() + share * x.back()) / (1 + z.front().x() + share * z.back().x());
  for (std::size_t i = 0; i < n; ++i) x[i] -= z[i].x() * factor;
  x.push_back(x.front());
  return x;
}

// The C2 spline with these values and slopes over simple knots: a control point is the blossom of a
// piece near it.
PlanCurve spline_through(const Points& p, const Points& slope) {
  const Chords c = chords_of(p);
  std::vector<double> parameter{0};
  for (const double h : c.length) parameter.push_back(parameter.back() + h);
  PlanCurve curve;
  curve.knots.assign(cubic, 0.0);
  curve.knots.insert(curve.knots.end(), parameter.begin(), parameter.end());
  curve.knots.insert(curve.knots.end(), cubic, parameter.back());
  const int pieces = static_cast<int>(c.length.size());
  for (int i = 0; i < pieces + cubic; ++i) {
    const int k = std::clamp(i - 1, 0, pieces - 1);
    const double h = c.length[k], a = parameter[k];
    const Vector2d c2 = (3 * c.slope[k] - 2 * slope[k] - slope[k + 1]) / h,
                   c3 = (slope[k] + slope[k + 1] - 2 * c.slope[k]) / (h * h);
    const double x = curve.knots[i + 1] - a, y = curve.knots[i + 2] - a, z = curve.knots[i + 3] - a;
    curve.control.push_back(p[k] + (x + y + z) / 3 * slope[k] + (x * y + y * z + z * x) / 3 * c2 +
                            x * y * z * c3);
  }
  curve.control.front() = p.front(), curve.control.back() = p.back();
  return curve;
}

Points without_repeats(std::span<const Vector2d> polyline) {
  Points p;
  for (const Vector2d& point : polyline) {
    if (p.empty() || point != p.back()) p.push_back(point);
  }
  while (p.size() > 1 && p.back() == p.front()) p.pop_back();
  return p;
}

}  // namespace

std::expected<std::vector<PlanCurve>, Error> smooth_sides(std::span<const Vector2d> polyline,
                                                          double corner_angle) {
  if (!std::ranges::all_of(polyline, [](const Vector2d& p) { return p.allFinite(); }))
    return std::unexpected(Error::not_finite);
  Points p = without_repeats(polyline);
  if (p.size() < 3) return std::unexpected(Error::too_few_points);
  if (signed_area(p) < 0) std::ranges::reverse(p);

  const std::size_t n = p.size();
  std::vector<std::size_t> corners;
  for (std::size_t i = 0; i < n; ++i) {
    const Vector2d in = p[i] - p[(i + n - 1) % n], out = p[(i + 1) % n] - p[i];
    const double turn = std::atan2(in.x() * out.y() - in.y() * out.x(), in.dot(out));
    if (std::abs(turn) > corner_angle) corners.push_back(i);
  }
  const auto stretch = [&](std::size_t from,
                           std::size_t to) {  // both ends included; once round if they are the same
    Points points{p[from]};
    do {
      from = (from + 1) % n;
      points.push_back(p[from]);
    } while (from != to);
    return points;
  };
  std::vector<PlanCurve> sides;
  if (corners.empty()) {
    const Points all = stretch(0, 0);
    sides.push_back(spline_through(all, closed_slopes(all)));
  }
  for (std::size_t k = 0; k < corners.size(); ++k) {
    const Points side = stretch(corners[k], corners[(k + 1) % corners.size()]);
    sides.push_back(spline_through(side, open_slopes(side)));
  }
  return sides;
}

}  // namespace moldloft::geometry
