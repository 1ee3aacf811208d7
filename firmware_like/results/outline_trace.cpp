#include "firmware_like/results/outline_trace.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace moldloft::firmware_like {
namespace {

double cross(const Eigen::Vector2d& a, const Eigen::Vector2d& b) { return a.x() * b.y() - a.y() * b.x(); }

}  // namespace

OutlineTrace::OutlineTrace(const geometry::Outline& outline) {
  for (const auto& side : outline.sides) {
    for (std::size_t i = 0; i < pieces_a_side; ++i) {
      const double part = static_cast<double>(i) / pieces_a_side;
      points_.push_back(side.value(side.begin() + part * (side.end() - side.begin())));
    }
  }
  points_.push_back(points_.front());
  along_.push_back(0);
  for (std::size_t i = 1; i < points_.size(); ++i)
    along_.push_back(along_.back() + (points_[i] - points_[i - 1]).norm());
}

OutlineTrace::Place OutlineTrace::locate(const Eigen::Vector2d& p) const {
  std::size_t best = 0;
  double least = std::numeric_limits<double>::infinity(), best_part = 0;
  for (std::size_t i = 0; i + 1 < points_.size(); ++i) {
    const Eigen::Vector2d piece = points_[i + 1] - points_[i], d = p - points_[i];
    const double square = piece.squaredNorm();
    const double part = square > 0 ? std::clamp(d.dot(piece) / square, 0.0, 1.0) : 0;
    const double distance = (d - part * piece).squaredNorm();
    if (distance < least) least = distance, best = i, best_part = part;
  }
  const Eigen::Vector2d piece = points_[best + 1] - points_[best];
  const Eigen::Vector2d foot = points_[best] + best_part * piece;
  Place place;
  place.side = best / pieces_a_side;
  const double here = along_[best] + best_part * piece.norm();
  place.from_corner_mm =
      std::min(here - along_[place.side * pieces_a_side], along_[(place.side + 1) * pieces_a_side] - here);
  place.outwards = Eigen::Vector2d{piece.y(), -piece.x()}.normalized();
  place.distance_mm = std::copysign(std::sqrt(least), (p - foot).dot(place.outwards));
  return place;
}

double OutlineTrace::area_mm2() const {
  double twice = 0;
  for (std::size_t i = 0; i + 1 < points_.size(); ++i)
    twice += cross(points_[i] - points_[0], points_[i + 1] - points_[0]);
  return twice / 2;
}

void OutlineTrace::crossings(double y, std::vector<double>& x) const {
  x.clear();
  for (std::size_t i = 0; i + 1 < points_.size(); ++i) {
    const Eigen::Vector2d &a = points_[i], &b = points_[i + 1];
    if ((a.y() <= y) == (b.y() <= y)) continue;
    x.push_back(a.x() + (y - a.y()) / (b.y() - a.y()) * (b.x() - a.x()));
  }
  std::ranges::sort(x);
}

}  // namespace moldloft::firmware_like
