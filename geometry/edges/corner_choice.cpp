#include "geometry/edges/corner_choice.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

// Vectors grow within what their constructor has reserved, which the compiler cannot know.
MOLDLOFT_GEOMETRY_CHECKED_AT_RUN_TIME

namespace moldloft::geometry {
namespace {

using Eigen::Vector2d;

constexpr std::size_t ring_capacity = 2048;
constexpr std::size_t fewest_points = 8;  // of a branch
constexpr int rounds = 3;                 // a candidate is moved to where its lines meet and looked at again

double cross(const Vector2d& a, const Vector2d& b) { return a.x() * b.y() - a.y() * b.x(); }

// The line of least squared distances through the points that `belongs` picks.
struct Line {
  Vector2d mean = Vector2d::Zero(), direction = Vector2d::UnitX();
  double rms = 0;
  std::size_t count = 0;
};

template <typename Belongs>
Line fit(std::span<const Vector2d> points, const Belongs& belongs) {
  Line line;
  double xx = 0, xy = 0, yy = 0;
  for (const auto& p : points) {
    if (!belongs(p)) continue;
    ++line.count;
    line.mean += p;
  }
  if (line.count == 0) return line;
  line.mean /= static_cast<double>(line.count);
  for (const auto& p : points) {
    if (!belongs(p)) continue;
    const Vector2d d = p - line.mean;
    xx += d.x() * d.x(), xy += d.x() * d.y(), yy += d.y() * d.y();
  }
  const double angle = 0.5 * std::atan2(2 * xy, xx - yy);
  line.direction = {std::cos(angle), std::sin(angle)};
  const double across = xx * std::pow(line.direction.y(), 2) + yy * std::pow(line.direction.x(), 2) -
                        2 * xy * line.direction.x() * line.direction.y();
  line.rms = std::sqrt(std::max(across, 0.0) / static_cast<double>(line.count));
  return line;
}

// The two directions in which the points leave `about`: each point goes to the nearer one, the directions follow.
struct Branches {
  Vector2d a, b;
};
Branches branches(std::span<const Vector2d> points, const Vector2d& about) {
  Branches two{(points.front() - about).normalized(), {}};
  double least = 2;
  for (const auto& p : points) {
    const Vector2d d = (p - about).normalized();
    if (d.dot(two.a) < least) least = d.dot(two.a), two.b = d;
  }
  for (int pass = 0; pass < 4; ++pass) {
    Vector2d a = Vector2d::Zero(), b = Vector2d::Zero();
    for (const auto& p : points) {
      const Vector2d d = (p - about).normalized();
      (d.dot(two.a) >= d.dot(two.b) ? a : b) += d;
    }
    if (a.norm() > 0) two.a = a.normalized();
    if (b.norm() > 0) two.b = b.normalized();
  }
  return two;
}

}  // namespace

CornerChoice::CornerChoice(const CornerChoiceSettings& settings) : settings_{settings} {
  ring_.reserve(ring_capacity);
  chosen_.reserve(settings.max_candidates);
}

std::size_t CornerChoice::bytes() const {
  return ring_.capacity() * sizeof(Vector2d) + chosen_.capacity() * sizeof(Corner);
}

void CornerChoice::begin(std::span<const Vector2d> edges, std::span<const Vector2d> candidates) {
  edges_ = edges;
  candidates_ = candidates.first(std::min(candidates.size(), settings_.max_candidates));
  chosen_.clear();
  next_ = 0, round_ = 0;
  checked_ = false;
}

std::expected<bool, Error> CornerChoice::step() {
  if (candidates_.empty() || edges_.size() < 2 * fewest_points) return std::unexpected(Error::too_few_points);
  if (!checked_) {
    const auto is_finite = [](const Vector2d& p) { return p.allFinite(); };
    if (!std::ranges::all_of(candidates_, is_finite) || !std::ranges::all_of(edges_, is_finite))
      return std::unexpected(Error::not_finite);
    checked_ = true;
    return false;
  }
  if (next_ < candidates_.size()) {
    if (round_ == 0) examined_ = {.position = candidates_[next_]};
    const bool is_corner = examine(candidates_[next_]);
    if (is_corner && ++round_ < rounds) return false;
    if (is_corner) keep(examined_);
    round_ = 0, ++next_;
    return false;
  }
  if (const auto arranged = arrange(); !arranged) return std::unexpected(arranged.error());
  return true;
}

void CornerChoice::gather(const Vector2d& about) {
  ring_.clear();
  for (const auto& p : edges_) {
    const double distance = (p - about).norm();
    if (distance < settings_.ring_inner_mm || distance > settings_.ring_outer_mm) continue;
    if (ring_.size() == ring_.capacity()) return;
    ring_.push_back(p);
  }
}

// One round of the candidate at hand; false when it is no corner.
bool CornerChoice::examine(const Vector2d& candidate) {
  gather(examined_.position);
  if (ring_.size() < 2 * fewest_points) return false;
  const Vector2d about = examined_.position;
  const Branches two = branches(ring_, about);
  const auto nearer_a = [&](const Vector2d& p) { return (p - about).dot(two.a) >= (p - about).dot(two.b); };
  const Line a = fit(ring_, nearer_a);
  const Line b = fit(ring_, [&](const Vector2d& p) { return !nearer_a(p); });
  if (a.count < fewest_points || b.count < fewest_points) return false;
  const Vector2d to_a = a.direction.dot(two.a) > 0 ? a.direction : Vector2d{-a.direction};
  const Vector2d to_b = b.direction.dot(two.b) > 0 ? b.direction : Vector2d{-b.direction};
  examined_.turn = std::numbers::pi - std::acos(std::clamp(to_a.dot(to_b), -1.0, 1.0));
  examined_.rms_mm = std::hypot(a.rms, b.rms);
  if (examined_.turn < settings_.min_turn) return false;
  examined_.position =
      a.mean + cross(b.mean - a.mean, b.direction) / cross(a.direction, b.direction) * a.direction;
  return examined_.position.allFinite() && (examined_.position - candidate).norm() <= settings_.ring_outer_mm;
}

// Of corners that lie together the one whose branches are straightest is kept.
void CornerChoice::keep(const Corner& corner) {
  for (auto& known : chosen_) {
    if ((known.position - corner.position).norm() > settings_.merge_mm) continue;
    if (corner.rms_mm < known.rms_mm) known = corner;
    return;
  }
  chosen_.push_back(corner);
}

std::expected<void, Error> CornerChoice::arrange() {
  if (chosen_.size() != 4) return std::unexpected(Error::not_four_sided);
  Vector2d middle = Vector2d::Zero();
  for (const auto& corner : chosen_) middle += corner.position / 4;
  std::sort(chosen_.begin(), chosen_.end(), [&](const Corner& p, const Corner& q) {
    const Vector2d a = p.position - middle, b = q.position - middle;
    return std::atan2(a.y(), a.x()) < std::atan2(b.y(), b.x());
  });
  const auto side = [&](std::size_t i) {
    return (chosen_[(i + 1) % 4].position - chosen_[i % 4].position).norm();
  };
  const std::size_t first = side(0) + side(2) >= side(1) + side(3) ? 0 : 1;
  for (std::size_t i = 0; i < 4; ++i) corners_[i] = chosen_[(first + i) % 4].position;
  return {};
}

}  // namespace moldloft::geometry
