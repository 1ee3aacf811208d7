#include "geometry/splines/closed_polygon.hpp"

#include <algorithm>

namespace moldloft::geometry {

namespace {

using Eigen::Vector2d;

double cross_product(const Vector2d& a, const Vector2d& b) { return a.x() * b.y() - a.y() * b.x(); }

struct Edge {
  Vector2d a, b;
};

Edge edge_of(std::span<const Vector2d> polygon, std::size_t i) {
  return {polygon[i], polygon[i + 1 < polygon.size() ? i + 1 : 0]};
}

bool boxes_apart(const Edge& p, const Edge& q) {
  for (int axis = 0; axis < 2; ++axis) {
    if (std::max(p.a[axis], p.b[axis]) < std::min(q.a[axis], q.b[axis])) return true;
    if (std::max(q.a[axis], q.b[axis]) < std::min(p.a[axis], p.b[axis])) return true;
  }
  return false;
}

// Boxes that touch and no line that has the other edge wholly on one side: the edges share a point.
bool touch(const Edge& p, const Edge& q) {
  if (boxes_apart(p, q)) return false;
  const auto on_one_side = [](const Edge& line, const Edge& other) {
    const double a = cross_product(line.b - line.a, other.a - line.a),
                 b = cross_product(line.b - line.a, other.b - line.a);
    return (a > 0 && b > 0) || (a < 0 && b < 0);
  };
  return !on_one_side(p, q) && !on_one_side(q, p);
}

bool turns_back(const Edge& p, const Edge& next) {
  const Vector2d d = p.b - p.a, e = next.b - next.a;
  return cross_product(d, e) == 0 && d.dot(e) < 0;
}

}  // namespace

double signed_area(std::span<const Vector2d> polygon) {
  if (polygon.size() < 3) return 0;
  // Relative to the first point, so that a polygon far from the origin keeps its digits.
  double twice = 0;
  for (std::size_t i = 1; i + 1 < polygon.size(); ++i)
    twice += cross_product(polygon[i] - polygon[0], polygon[i + 1] - polygon[0]);
  return twice / 2;
}

bool contains(std::span<const Vector2d> polygon, const Vector2d& point) {
  if (polygon.size() < 3) return false;
  bool inside = false;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Edge e = edge_of(polygon, i);
    if ((e.a.y() > point.y()) == (e.b.y() > point.y())) continue;
    const double x = e.a.x() + (point.y() - e.a.y()) / (e.b.y() - e.a.y()) * (e.b.x() - e.a.x());
    if (point.x() < x) inside = !inside;
  }
  return inside;
}

bool crosses_itself(std::span<const Vector2d> polygon) {
  const std::size_t n = polygon.size();
  if (n < 3) return false;
  for (std::size_t i = 0; i < n; ++i) {
    const Edge e = edge_of(polygon, i);
    if (turns_back(e, edge_of(polygon, (i + 1) % n))) return true;
    const std::size_t last = i == 0 ? n - 1 : n;  // the first edge and the last one are neighbours
    for (std::size_t j = i + 2; j < last; ++j) {
      if (touch(e, edge_of(polygon, j))) return true;
    }
  }
  return false;
}

bool cross(std::span<const Vector2d> first, std::span<const Vector2d> second) {
  for (std::size_t i = 0; i < first.size(); ++i) {
    const Edge e = edge_of(first, i);
    for (std::size_t j = 0; j < second.size(); ++j) {
      if (touch(e, edge_of(second, j))) return true;
    }
  }
  return false;
}

}  // namespace moldloft::geometry
