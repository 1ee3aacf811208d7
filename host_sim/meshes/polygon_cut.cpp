#include "host_sim/meshes/triangle_mesh.hpp"

#include <Eigen/Geometry>

#include <algorithm>

namespace moldloft::host_sim {

namespace {

constexpr std::size_t most_ear_corners = 5000;  // ears cost the square of the corners: a quarter of a second

// One face in its own plane. The ears are cut off one after the other, each the first that holds no other corner.
class EarCut {
 public:
  EarCut(const TriangleMesh& mesh, std::span<const int> corners) : ring_(corners.begin(), corners.end()) {
    ring_.erase(std::unique(ring_.begin(), ring_.end()), ring_.end());
    if (ring_.size() > 1 && ring_.front() == ring_.back()) ring_.pop_back();  // closed by its first corner
    const auto at = [&](std::size_t k) { return mesh.vertices[static_cast<std::size_t>(ring_[k])]; };
    Eigen::Vector3d normal = Eigen::Vector3d::Zero();
    for (std::size_t k = 2; k < ring_.size(); ++k) normal += (at(k - 1) - at(0)).cross(at(k) - at(0));
    const Eigen::Vector3d x = normal.unitOrthogonal(), y = normal.normalized().cross(x);
    for (std::size_t k = 0; k < ring_.size(); ++k) {
      const Eigen::Vector3d p = at(k) - at(0);
      plan_.emplace_back(p.dot(x), p.dot(y));
    }
  }

  std::size_t size() const { return ring_.size(); }
  bool is_convex() const {
    for (std::size_t k = 0; k < size(); ++k) {
      if (turn(k, (k + 1) % size(), (k + 2) % size()) < 0) return false;
    }
    return true;
  }
  void fan(std::vector<Triangle>& triangles) const {
    for (std::size_t k = 2; k < size(); ++k) triangles.push_back({ring_[0], ring_[k - 1], ring_[k]});
  }
  void ears(std::vector<Triangle>& triangles) {
    while (size() > 3) {
      std::size_t ear = 0;
      while (ear < size() && !is_ear(ear)) ++ear;
      if (ear == size()) ear = 0;  // crosses itself: cut somewhere; what folds over is found later
      triangles.push_back({ring_[before(ear)], ring_[ear], ring_[after(ear)]});
      ring_.erase(ring_.begin() + static_cast<std::ptrdiff_t>(ear));
      plan_.erase(plan_.begin() + static_cast<std::ptrdiff_t>(ear));
    }
    fan(triangles);
  }

 private:
  std::size_t before(std::size_t k) const { return (k + size() - 1) % size(); }
  std::size_t after(std::size_t k) const { return (k + 1) % size(); }
  double turn(std::size_t a, std::size_t b, std::size_t c) const {
    const Eigen::Vector2d u = plan_[b] - plan_[a], v = plan_[c] - plan_[b];
    return u.x() * v.y() - u.y() * v.x();
  }
  bool is_ear(std::size_t k) const {
    const std::size_t a = before(k), c = after(k);
    if (turn(a, k, c) <= 0) return false;
    for (std::size_t p = 0; p < size(); ++p) {
      if (p == a || p == k || p == c) continue;
      if (turn(a, k, p) >= 0 && turn(k, c, p) >= 0 && turn(c, a, p) >= 0) return false;
    }
    return true;
  }

  std::vector<int> ring_;
  std::vector<Eigen::Vector2d> plan_;
};

}  // namespace

bool Polygons::cut_into_triangles(TriangleMesh& mesh) const {
  mesh.triangles.reserve(mesh.triangles.size() + ends_.size());
  std::size_t begin = 0;
  for (const std::size_t end : ends_) {
    const std::span<const int> corners{corners_.data() + begin, end - begin};
    begin = end;
    if (corners.size() < 3) continue;
    if (corners.size() == 3) {
      mesh.triangles.push_back({corners[0], corners[1], corners[2]});
      continue;
    }
    EarCut face(mesh, corners);
    if (face.size() < 3) continue;
    if (face.is_convex()) {
      face.fan(mesh.triangles);
    } else {
      if (face.size() > most_ear_corners) return false;
      face.ears(mesh.triangles);
    }
  }
  return true;
}

}  // namespace moldloft::host_sim
