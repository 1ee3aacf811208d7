#include "host_sim/base/plan_polygon.hpp"

#include "geometry/splines/convex_hull.hpp"

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

std::array<Eigen::Vector2d, 4> largest_quadrilateral(PlanPoints points) {
  const auto hull = geometry::convex_hull({points.begin(), points.end()});
  const std::size_t n = hull.size();
  const auto area = [&](std::size_t i, std::size_t j, std::size_t k) {  // doubled, of the triangle
    return std::abs(cross(hull[j % n] - hull[i % n], hull[k % n] - hull[i % n]));
  };
  // The hull vertex farthest from the chord i-j goes on as j does: it is looked for from where it was last.
  const auto go_on = [&](std::size_t i, std::size_t j, std::size_t& k, std::size_t end) {
    while (k + 1 < end && area(i, j, k + 1) > area(i, j, k)) ++k;
    return k < end ? area(i, j, k) : 0.0;
  };
  std::array<std::size_t, 4> best{};
  double best_area = -1;
  for (std::size_t i = 0; i < n; ++i) {
    std::size_t right = i + 1, left = i + 3;
    for (std::size_t j = i + 2; j < n; ++j) {
      left = std::max(left, j + 1);
      const double both = go_on(i, j, right, j) + go_on(i, j, left, i + n);
      if (both > best_area) {
        best_area = both;
        best = {i, right, j, left < i + n ? left % n : j};
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
