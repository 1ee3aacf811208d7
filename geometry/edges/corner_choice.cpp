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
constexpr int divisions = 4;              // of a ring's points between the two branches
// Of the edge; a ring's points cost more and are at most half as many.
constexpr std::size_t points_a_step = 4096;

double cross(const Vector2d& a, const Vector2d& b) { return a.x() * b.y() - a.y() * b.x(); }

// The line of least squared distances through the points that `belongs` picks.
template <typename Belongs>
CornerLine fit(std::span<const Vector2d> points, const Belongs& belongs) {
  CornerLine line;
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

}  // namespace

CornerChoice::CornerChoice(const CornerChoiceSettings& settings) : settings_{settings} {
  ring_.reserve(ring_capacity);
  chosen_.reserve(settings.max_candidates);
}

std::size_t CornerChoice::bytes() const {
  return ring_.capacity() * sizeof(Vector2d) + chosen_.capacity() * sizeof(Corner);
}

void CornerChoice::begin(std::span<const Vector2d> edges, std::span<const Vector2d> candidates,
                         double scale) {
  scale_ = scale;
  edges_ = edges;
  candidates_ = candidates;
  chosen_.clear();
  next_ = 0, round_ = 0, edge_ = 0;
  stage_ = Stage::check;
}

std::expected<bool, Error> CornerChoice::step() {
  if (candidates_.size() > settings_.max_candidates) return std::unexpected(Error::capacity);
  if (candidates_.empty() || edges_.size() < 2 * fewest_points) return std::unexpected(Error::too_few_points);
  switch (stage_) {
    case Stage::check: {
      const auto is_finite = [](const Vector2d& p) { return p.allFinite(); };
      const auto piece = next_edges();
      if (!std::ranges::all_of(candidates_, is_finite) || !std::ranges::all_of(piece, is_finite))
        return std::unexpected(Error::not_finite);
      if (edge_ == edges_.size()) begin_round(candidates_.front());
      return false;
    }
    case Stage::gather:
      if (gather(next_edges())) end_gathering();
      return false;
    case Stage::spread:
      spread();
      stage_ = Stage::divide, division_ = 0;
      return false;
    case Stage::divide:
      divide();
      if (++division_ == divisions) stage_ = Stage::line_a;
      return false;
    case Stage::line_a:
      lines_[0] = fit(ring_, [&](const Vector2d& p) { return nearer_a(p); });
      stage_ = Stage::line_b;
      return false;
    case Stage::line_b:
      lines_[1] = fit(ring_, [&](const Vector2d& p) { return !nearer_a(p); });
      end_round(meet());
      return false;
    case Stage::arrange:
      if (const auto arranged = arrange(); !arranged) return std::unexpected(arranged.error());
      return true;
  }
  return true;
}

std::span<const Vector2d> CornerChoice::next_edges() {
  const auto piece = edges_.subspan(edge_, std::min(points_a_step, edges_.size() - edge_));
  edge_ += piece.size();
  return piece;
}

void CornerChoice::begin_round(const Vector2d& about) {
  about_ = about;
  ring_.clear();
  edge_ = 0;
  stage_ = Stage::gather;
}

// True when the ring is complete, or full.
bool CornerChoice::gather(std::span<const Vector2d> edges) {
  for (const auto& p : edges) {
    const double distance = (p - about_).norm();
    if (distance < scale_ * settings_.ring_inner_mm || distance > scale_ * settings_.ring_outer_mm) continue;
    if (ring_.size() == ring_.capacity()) return true;
    ring_.push_back(p);
  }
  return edge_ == edges_.size();
}

void CornerChoice::end_gathering() {
  if (ring_.size() < 2 * fewest_points) return end_round(false);
  stage_ = Stage::spread;
}

// The two directions in which the ring's points leave: that of its first point, and the one that differs most ...
void CornerChoice::spread() {
  branch_a_ = (ring_.front() - about_).normalized();
  double least = 2;
  for (const auto& p : ring_) {
    const Vector2d d = (p - about_).normalized();
    if (d.dot(branch_a_) < least) least = d.dot(branch_a_), branch_b_ = d;
  }
}

// ... then each point goes to the nearer one, and the directions follow.
void CornerChoice::divide() {
  Vector2d a = Vector2d::Zero(), b = Vector2d::Zero();
  for (const auto& p : ring_) {
    const Vector2d d = (p - about_).normalized();
    (d.dot(branch_a_) >= d.dot(branch_b_) ? a : b) += d;
  }
  if (a.norm() > 0) branch_a_ = a.normalized();
  if (b.norm() > 0) branch_b_ = b.normalized();
}

bool CornerChoice::nearer_a(const Vector2d& p) const {
  return (p - about_).dot(branch_a_) >= (p - about_).dot(branch_b_);
}

// Moves the candidate at hand to where the lines of its branches meet; false when it is no corner.
bool CornerChoice::meet() {
  const auto& [a, b] = lines_;
  if (a.count < fewest_points || b.count < fewest_points) return false;
  const Vector2d to_a = a.direction.dot(branch_a_) > 0 ? a.direction : Vector2d{-a.direction};
  const Vector2d to_b = b.direction.dot(branch_b_) > 0 ? b.direction : Vector2d{-b.direction};
  examined_.turn = std::numbers::pi - std::acos(std::clamp(to_a.dot(to_b), -1.0, 1.0));
  examined_.rms_mm = std::hypot(a.rms, b.rms);
  if (examined_.turn < settings_.min_turn) return false;
  examined_.position =
      a.mean + cross(b.mean - a.mean, b.direction) / cross(a.direction, b.direction) * a.direction;
  return examined_.position.allFinite() &&
         (examined_.position - candidates_[next_]).norm() <= scale_ * settings_.ring_outer_mm;
}

void CornerChoice::end_round(bool is_corner) {
  if (is_corner && ++round_ < rounds) return begin_round(examined_.position);
  if (is_corner) keep(examined_);
  round_ = 0;
  if (++next_ < candidates_.size()) return begin_round(candidates_[next_]);
  stage_ = Stage::arrange;
}

// Of corners that lie together the one whose branches are straightest is kept.
void CornerChoice::keep(const Corner& corner) {
  for (auto& known : chosen_) {
    if ((known.position - corner.position).norm() > scale_ * settings_.merge_mm) continue;
    if (corner.rms_mm < known.rms_mm) known = corner;
    return;
  }
  chosen_.push_back(corner);
}

std::expected<void, Error> CornerChoice::arrange() {
  Vector2d middle = Vector2d::Zero();
  for (const auto& corner : chosen_) middle += corner.position / static_cast<double>(chosen_.size());
  std::sort(chosen_.begin(), chosen_.end(), [&](const Corner& p, const Corner& q) {
    const Vector2d a = p.position - middle, b = q.position - middle;
    return std::atan2(a.y(), a.x()) < std::atan2(b.y(), b.x());
  });
  if (chosen_.size() != 4) return std::unexpected(Error::not_four_sided);
  const auto side = [&](std::size_t i) {
    return (chosen_[(i + 1) % 4].position - chosen_[i % 4].position).norm();
  };
  const std::size_t first = side(0) + side(2) >= side(1) + side(3) ? 0 : 1;
  for (std::size_t i = 0; i < 4; ++i) corners_[i] = chosen_[(first + i) % 4].position;
  return {};
}

}  // namespace moldloft::geometry
