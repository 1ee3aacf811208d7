#include "tasks/planning/scan_plan.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

// Fixed-size Eigen throughout: constants that it keeps in local statics, and function pointers in its reductions, hide
// from the compiler that nothing here waits or allocates.
MOLDLOFT_CHECKED_AT_RUN_TIME

namespace moldloft::tasks {
namespace {

using Eigen::Vector2d;

struct Box {
  Vector2d min{INFINITY, INFINITY}, max{-INFINITY, -INFINITY};
  double area() const { return (max - min).prod(); }
};

Eigen::Matrix2d into_axes(double yaw) {
  const double c = std::cos(yaw), s = std::sin(yaw);
  return Eigen::Matrix2d{{c, s}, {-s, c}};
}

Box box_along(const Eigen::Matrix2d& axes, std::span<const Vector2d> points) {
  Box box;
  for (const auto& p : points) {
    const Vector2d q = axes * p;
    box.min = box.min.cwiseMin(q);
    box.max = box.max.cwiseMax(q);
  }
  return box;
}

}  // namespace

void ZigzagPlan::begin(const geometry::Outline& outline, const HeightModel& heights,
                       const ScanPlanSettings& settings, const Vector2d& from, double head_yaw_now,
                       std::span<ShotPlace> places) {
  outline_ = &outline;
  heights_ = &heights;
  settings_ = settings;
  from_ = from;
  yaw_ = head_yaw_now;
  places_ = places;
  count_ = 0;
  side_ = row_ = 0;
  stage_ = Stage::sample;
}

bool ZigzagPlan::step() {
  switch (stage_) {
    case Stage::sample:
      sample_side(side_);
      if (++side_ == 4) stage_ = Stage::turn;
      return false;
    case Stage::turn:
      turn_to_plate();
      stage_ = Stage::rows;
      return false;
    case Stage::rows:
      if (!add_row())
        stage_ = Stage::too_many;
      else if (++row_ == rows_.count)
        stage_ = Stage::done;
      return stage_ != Stage::rows;
    case Stage::too_many:
    case Stage::done:
      break;
  }
  return true;
}

std::expected<std::size_t, geometry::Error> ZigzagPlan::result() const {
  if (stage_ == Stage::too_many) return std::unexpected{geometry::Error::capacity};
  return count_;
}

void ZigzagPlan::sample_side(std::size_t side) {
  for (std::size_t i = 0; i < samples_per_side; ++i) {
    points_[side * samples_per_side + i] =
        outline_->sides[side].at(static_cast<double>(i) / samples_per_side).value;
  }
}

// The least box has a side along a side of the convex hull; for a plate of four smooth sides the chords are near
// enough. From then on the samples are in the box's own axes.
void ZigzagPlan::turn_to_plate() {
  Box box;
  double least = INFINITY, yaw = 0;
  for (std::size_t i = 0; i < 4; ++i) {
    const Vector2d chord = outline_->corners[(i + 1) % 4] - outline_->corners[i];
    const double along = std::atan2(chord.y(), chord.x());
    const Eigen::Matrix2d axes = into_axes(along);
    const Box tried = box_along(axes, points_);
    if (tried.area() >= least) continue;
    least = tried.area();
    box = tried;
    yaw = along;
    box_from_world_ = axes;
  }
  for (auto& p : points_) p = box_from_world_ * p;
  yaw_ = yaw + std::round((yaw_ - yaw) / std::numbers::pi) * std::numbers::pi;
  rows_ = spread(box.min.y(), box.max.y(), settings_.field_y_mm);
  const Vector2d start = box_from_world_ * from_;
  from_top_ = start.y() > (box.min.y() + box.max.y()) / 2;
  forwards_ = start.x() < (box.min.x() + box.max.x()) / 2;
}

bool ZigzagPlan::add_row() {
  const double y = rows_.first + (from_top_ ? rows_.count - 1 - row_ : row_) * rows_.step;
  const auto [low, high] = extent_between(y - settings_.field_y_mm / 2, y + settings_.field_y_mm / 2);
  const bool forwards = std::exchange(forwards_, !forwards_);
  if (low > high) return true;
  const Spread columns = spread(low, high, settings_.field_x_mm);
  for (int column = 0; column < columns.count; ++column) {
    if (count_ == places_.size()) return false;
    const double x = columns.first + (forwards ? column : columns.count - 1 - column) * columns.step;
    const Vector2d centre = box_from_world_.transpose() * Vector2d{x, y};
    places_[count_++] = {.centre = {centre.x(), centre.y(), heights_->at(centre.x(), centre.y())},
                         .head_yaw = yaw_};
  }
  return true;
}

// Fields that cover the length with the wanted overlap.
ZigzagPlan::Spread ZigzagPlan::spread(double from, double to, double field) const {
  const double length = to - from + 2 * settings_.margin_mm;
  Spread s;
  if (length > field)
    s.count = 1 + static_cast<int>(std::ceil((length - field) / (field - settings_.overlap_mm) - 1e-9));
  s.step = s.count > 1 ? (length - field) / (s.count - 1) : 0;
  s.first = s.count > 1 ? from - settings_.margin_mm + field / 2 : (from + to) / 2;
  return s;
}

// How far the outline reaches along the box's first axis between two heights of its second.
std::pair<double, double> ZigzagPlan::extent_between(double low, double high) const {
  double from = INFINITY, to = -INFINITY;
  for (std::size_t i = 0; i < points_.size(); ++i) {
    Vector2d a = points_[i], b = points_[(i + 1) % points_.size()];
    if (a.y() > b.y()) std::swap(a, b);
    if (b.y() < low || a.y() > high) continue;
    const double rise = std::max(b.y() - a.y(), 1e-12);
    for (const double y : {std::max(a.y(), low), std::min(b.y(), high)}) {
      const double x = a.x() + (b.x() - a.x()) * std::clamp((y - a.y()) / rise, 0.0, 1.0);
      from = std::min(from, x);
      to = std::max(to, x);
    }
  }
  return {from, to};
}

}  // namespace moldloft::tasks
