#include "geometry/splines/convex_hull.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>

namespace moldloft::geometry {
namespace {

double cross_product(const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  return a.x() * b.y() - a.y() * b.x();
}

}  // namespace

std::vector<Eigen::Vector2d> convex_hull(std::vector<Eigen::Vector2d> points) {
  std::ranges::sort(points, [](const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
    return a.x() != b.x() ? a.x() < b.x() : a.y() < b.y();
  });
  std::vector<Eigen::Vector2d> hull;
  const auto add = [&](const Eigen::Vector2d& p, std::size_t keep) {
    while (hull.size() >= keep + 2 &&
           cross_product(hull.back() - hull[hull.size() - 2], p - hull.back()) <= 0)
      hull.pop_back();
    hull.push_back(p);
  };
  for (const Eigen::Vector2d& p : points) add(p, 0);
  const std::size_t lower = hull.size() - 1;
  for (std::size_t i = points.size() - 1; i-- > 0;) add(points[i], lower);
  hull.pop_back();
  return hull;
}

PlanRectangle smallest_rectangle(const std::vector<Eigen::Vector2d>& hull) {
  PlanRectangle best;
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < hull.size(); ++i) {
    const Eigen::Vector2d side = hull[(i + 1) % hull.size()] - hull[i];
    if (!(side.norm() > 0)) continue;
    const Eigen::Vector2d along = side.normalized(), across{-along.y(), along.x()};
    double low = 0, high = 0, deep = 0;
    for (const auto& p : hull) {
      const double t = along.dot(p - hull[i]);
      low = std::min(low, t), high = std::max(high, t);
      deep = std::max(deep, std::abs(across.dot(p - hull[i])));
    }
    if ((high - low) * deep >= least) continue;
    least = (high - low) * deep;
    const bool turned = deep > high - low;
    best = {turned ? across : along, turned ? deep : high - low, turned ? high - low : deep};
  }
  return best;
}

}  // namespace moldloft::geometry
