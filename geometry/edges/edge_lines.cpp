#include "geometry/edges/edge_lines.hpp"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <limits>

namespace moldloft::geometry {

namespace {

Eigen::Vector2d plan(const EdgePoint& point) { return point.position.head<2>(); }

// Sums over points from which a line's residual follows; differences of prefix sums give any stretch.
struct Moments {
  double n = 0, x = 0, y = 0, xx = 0, xy = 0, yy = 0;
  void add(const Eigen::Vector2d& p, double w = 1) {
    n += w, x += w * p.x(), y += w * p.y();
    xx += w * p.x() * p.x(), xy += w * p.x() * p.y(), yy += w * p.y() * p.y();
  }
  Moments operator-(const Moments& o) const {
    return {n - o.n, x - o.x, y - o.y, xx - o.xx, xy - o.xy, yy - o.yy};
  }
  double sxx() const { return xx - x * x / n; }
  double sxy() const { return xy - x * y / n; }
  double syy() const { return yy - y * y / n; }
  double squares_about_line() const {  // the smaller eigenvalue of the scatter matrix
    const double half = 0.5 * (sxx() + syy()), det = sxx() * syy() - sxy() * sxy();
    return std::max(0.0, det / (half + std::sqrt(std::max(0.0, half * half - det)) + 1e-300));
  }
};

EdgeLine line_from(const Moments& m) {
  const double angle = 0.5 * std::atan2(2 * m.sxy(), m.sxx() - m.syy());
  return {{m.x / m.n, m.y / m.n}, {std::cos(angle), std::sin(angle)}, 0};
}

// A line through up to five points that one of them cannot tilt: the median of the slopes of all pairs in the
// frame of the chord (Theil-Sen), then the median offset. Returns the residual of `p` about it.
double residual_to_neighbours(std::span<const EdgePoint> near, const Eigen::Vector2d& p) {
  std::array<double, 10> slopes;
  std::array<double, 5> offsets;
  Eigen::Vector2d along = plan(near.back()) - plan(near.front());
  if (along.norm() < 1e-6) return std::numeric_limits<double>::infinity();
  along.normalize();
  const Eigen::Vector2d across(-along.y(), along.x());
  std::size_t count = 0;
  for (std::size_t i = 0; i < near.size(); ++i) {
    for (std::size_t j = i + 1; j < near.size(); ++j) {
      const Eigen::Vector2d d = plan(near[j]) - plan(near[i]);
      const double run = d.dot(along);
      if (std::abs(run) > 1e-6) slopes[count++] = d.dot(across) / run;
    }
  }
  if (count == 0) return std::numeric_limits<double>::infinity();
  std::nth_element(slopes.begin(), slopes.begin() + count / 2, slopes.begin() + count);
  const double slope = slopes[count / 2];
  for (std::size_t i = 0; i < near.size(); ++i) {
    offsets[i] = plan(near[i]).dot(across) - slope * plan(near[i]).dot(along);
  }
  std::nth_element(offsets.begin(), offsets.begin() + near.size() / 2, offsets.begin() + near.size());
  const double offset = offsets[near.size() / 2];
  return std::abs(p.dot(across) - slope * p.dot(along) - offset) / std::sqrt(1 + slope * slope);
}

constexpr double false_point_mm =
    0.8;  // ten standard deviations of an edge point, and a dent that an outline may have

}  // namespace

EdgeLine fit_edge_line(std::span<const EdgePoint> points) {
  assert(points.size() >= 2);
  const Eigen::Vector2d origin = plan(points.front());
  EdgeLine line;
  double scale = std::numeric_limits<double>::infinity();
  for (int pass = 0; pass < 5; ++pass) {
    Moments moments;
    double squares = 0, absolute = 0;
    for (const EdgePoint& point : points) {
      const double r = pass == 0 ? 0.0 : std::abs(line.distance(plan(point) - origin));
      const double weight = r <= 1.5 * scale ? 1.0 : 1.5 * scale / r;
      moments.add(plan(point) - origin, weight);
    }
    line = line_from(moments);
    for (const EdgePoint& point : points) {
      const double r = std::abs(line.distance(plan(point) - origin));
      absolute += r;
      const double clipped = std::min(r, 1.5 * scale);
      squares += clipped * clipped;
    }
    line.rms_mm = std::sqrt(squares / static_cast<double>(points.size()));
    // The mean deviation gives a standard deviation that single points pull at only linearly; it falls
    // with each pass.
    scale = std::max(std::min(scale, 1.25 * absolute / static_cast<double>(points.size())), 1e-3);
    scale = std::max(std::min(scale, 1.2 * line.rms_mm), 1e-3);
  }
  line.centre += origin;
  if (line.direction.dot(plan(points.back()) - plan(points.front())) < 0) line.direction = -line.direction;
  return line;
}

std::optional<Eigen::Vector2d> meeting_point(const EdgeLine& a, const EdgeLine& b) {
  const double cross = a.direction.x() * b.direction.y() - a.direction.y() * b.direction.x();
  if (!(std::abs(cross) >= 0.03)) return std::nullopt;
  const Eigen::Vector2d d = b.centre - a.centre;
  const double along = (d.x() * b.direction.y() - d.y() * b.direction.x()) / cross;
  const Eigen::Vector2d meeting = a.centre + along * a.direction;
  if (!meeting.allFinite()) return std::nullopt;
  return meeting;
}

bool is_false_point(std::span<const EdgePoint> points, std::size_t index) {
  if (points.size() < 6) return false;  // too few to judge by
  const Eigen::Vector2d p = plan(points[index]);
  const auto off = [&](std::size_t from, std::size_t to) {
    std::array<EdgePoint, 5> near;
    std::size_t count = 0;
    for (std::size_t i = from; i < to; ++i) {
      if (i != index) near[count++] = points[i];
    }
    return residual_to_neighbours({near.data(), count}, p) > false_point_mm;
  };
  const std::size_t n = points.size();
  // Nearly every point lies on the line before it: the one behind is looked at only where it does not.
  const bool off_before = index >= 3 ? off(index - std::min<std::size_t>(index, 5), index) : off(0, 4);
  return off_before && (n - index > 3 ? off(index + 1, std::min(index + 6, n)) : off(n - 4, n));
}

std::size_t best_split(std::span<const EdgePoint> points, std::size_t min_side) {
  if (points.size() < 2 * min_side || min_side < 2) return 0;
  const Eigen::Vector2d origin = plan(points[points.size() / 2]);
  Moments all, before;
  for (const EdgePoint& point : points) all.add(plan(point) - origin);
  std::size_t best = 0;
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t s = 0; s + min_side <= points.size(); ++s) {
    if (s >= min_side) {
      const double squares = before.squares_about_line() + (all - before).squares_about_line();
      if (squares < least) least = squares, best = s;
    }
    before.add(plan(points[s]) - origin);
  }
  return best;
}

std::size_t split_at_farthest(std::span<const EdgePoint> points, double length_mm, std::size_t min_side) {
  if (points.size() < 2 * min_side) return 0;
  const Eigen::Vector2d a = plan(points.front()), d = plan(points.back()) - a;
  std::size_t farthest = 0;
  double most = 0;
  for (std::size_t i = 1; i + 1 < points.size(); ++i) {
    const Eigen::Vector2d p = plan(points[i]) - a;
    const double distance = std::abs(d.x() * p.y() - d.y() * p.x());
    if (distance > most) most = distance, farthest = i;
  }
  if (farthest == 0) return 0;
  const std::size_t before = last_stretch(points.first(farthest + 1), length_mm, min_side).size();
  const std::size_t after = first_stretch(points.subspan(farthest), length_mm, min_side).size();
  const std::size_t from = farthest + 1 - before;
  const std::size_t split = best_split(points.subspan(from, before + after - 1), min_side);
  return split == 0 ? 0 : from + split;
}

std::span<const EdgePoint> first_stretch(std::span<const EdgePoint> points, double length_mm,
                                         std::size_t min_points) {
  std::size_t n = 0;
  while (n < points.size() &&
         (n < min_points || (plan(points[n]) - plan(points.front())).norm() <= length_mm))
    ++n;
  return points.first(n);
}

std::span<const EdgePoint> last_stretch(std::span<const EdgePoint> points, double length_mm,
                                        std::size_t min_points) {
  std::size_t n = 0;
  while (
      n < points.size() &&
      (n < min_points || (plan(points[points.size() - 1 - n]) - plan(points.back())).norm() <= length_mm)) {
    ++n;
  }
  return points.last(n);
}

}  // namespace moldloft::geometry
