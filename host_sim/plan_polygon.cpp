#include "host_sim/plan_polygon.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace moldloft::host_sim {

namespace {

double cross(const Eigen::Vector2d& a, const Eigen::Vector2d& b) { return a.x() * b.y() - a.y() * b.x(); }

double turn_of(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const Eigen::Vector2d& c) {
  return cross(b - a, c - b);
}

}  // namespace

double signed_area(PlanPoints polygon) {
  double twice = 0;
  for (std::size_t i = 0, j = polygon.size() - 1; i < polygon.size(); j = i++)
    twice += cross(polygon[j], polygon[i]);
  return 0.5 * twice;
}

Eigen::Vector2d centroid(PlanPoints polygon) {
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  const Eigen::Vector2d origin = polygon.front();  // near the polygon, so that nothing large cancels
  double twice = 0;
  for (std::size_t i = 0, j = polygon.size() - 1; i < polygon.size(); j = i++) {
    const Eigen::Vector2d a = polygon[j] - origin, b = polygon[i] - origin;
    const double area = cross(a, b);
    twice += area;
    sum += area * (a + b);
  }
  return origin + sum / (3.0 * twice);
}

bool contains(PlanPoints polygon, double x, double y) noexcept {
  bool in = false;
  for (std::size_t i = 0, j = polygon.size() - 1; i < polygon.size(); j = i++) {
    const auto &a = polygon[i], &b = polygon[j];
    if ((a.y() > y) != (b.y() > y) && x < (b.x() - a.x()) * (y - a.y()) / (b.y() - a.y()) + a.x()) in = !in;
  }
  return in;
}

bool is_convex(PlanPoints polygon) noexcept {
  const std::size_t n = polygon.size();
  for (std::size_t i = 0; i < n; ++i) {
    if (turn_of(polygon[i], polygon[(i + 1) % n], polygon[(i + 2) % n]) <= 0) return false;
  }
  return true;
}

double distance_to_outline(PlanPoints polygon, const Eigen::Vector2d& p) noexcept {
  double best = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0, j = polygon.size() - 1; i < polygon.size(); j = i++) {
    const Eigen::Vector2d a = polygon[j], d = polygon[i] - a;
    const double t = std::clamp((p - a).dot(d) / std::max(d.squaredNorm(), 1e-300), 0.0, 1.0);
    best = std::min(best, (a + t * d - p).squaredNorm());
  }
  return std::sqrt(best);
}

std::vector<Eigen::Vector2d> convex_hull(PlanPoints points) {  // Andrew's monotone chain
  std::vector<Eigen::Vector2d> sorted(points.begin(), points.end());
  std::sort(sorted.begin(), sorted.end(),
            [](const auto& a, const auto& b) { return a.x() < b.x() || (a.x() == b.x() && a.y() < b.y()); });
  std::vector<Eigen::Vector2d> hull;
  const auto add = [&hull](const Eigen::Vector2d& p, std::size_t keep) {
    while (hull.size() >= keep + 2 && turn_of(hull[hull.size() - 2], hull.back(), p) <= 0) hull.pop_back();
    hull.push_back(p);
  };
  for (const auto& p : sorted) add(p, 0);
  const std::size_t lower = hull.size() - 1;
  for (std::size_t i = sorted.size() - 1; i-- > 0;) add(sorted[i], lower);
  hull.pop_back();
  return hull;
}

std::array<Eigen::Vector2d, 4> largest_quadrilateral(PlanPoints points) {
  const auto hull = convex_hull(points);
  const std::size_t n = hull.size();
  const auto farthest = [&](std::size_t from,
                            std::size_t to) {  // the hull vertex between them, farthest from the chord
    std::size_t best = from;
    double best_area = 0;
    for (std::size_t k = from + 1; k < to; ++k) {
      const double area = std::abs(cross(hull[to % n] - hull[from % n], hull[k % n] - hull[from % n]));
      if (area > best_area) best_area = area, best = k;
    }
    return std::pair{best % n, best_area};
  };
  std::array<std::size_t, 4> best{};
  double best_area = -1;
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t j = i + 2; j < n; ++j) {
      const auto right = farthest(i, j), left = farthest(j, i + n);
      if (right.second + left.second > best_area) {
        best_area = right.second + left.second;
        best = {i, right.first, j, left.first};
      }
    }
  }
  std::array<Eigen::Vector2d, 4> corners;
  for (std::size_t k = 0; k < 4; ++k) corners[k] = hull[best[k]];
  const auto first = std::min_element(corners.begin(), corners.end(),
                                      [](const auto& a, const auto& b) { return a.sum() < b.sum(); });
  std::rotate(corners.begin(), first, corners.end());
  return corners;
}

std::vector<Eigen::Vector2d> sampled_outline(PlanPoints polygon, double step_mm) {
  std::vector<Eigen::Vector2d> points;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Eigen::Vector2d a = polygon[i], d = polygon[(i + 1) % polygon.size()] - a;
    const int pieces = std::max(1, static_cast<int>(std::ceil(d.norm() / step_mm)));
    for (int k = 0; k < pieces; ++k) points.push_back(a + d * (static_cast<double>(k) / pieces));
  }
  return points;
}

}  // namespace moldloft::host_sim
