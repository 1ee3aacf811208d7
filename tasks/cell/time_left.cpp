#include "tasks/cell/time_left.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace moldloft::tasks {
namespace {

// As much of the outline as must have been walked until what was seen weighs as much as what was guessed before.
constexpr double part_that_convinces = 0.6;

// Half a square's side and half its diagonal: the start sees the edge somewhere between, with the plate at any angle.
constexpr double side_by_distance = 2 * 0.8;

// One edge says little: it may be a long plate's near side. So the guess leans, with this weight, on a plate
// of usual size for its scanner, so many fields long. All of it is done in the logarithm, because half and
// twice are equally wrong.
constexpr double usual_fields = 2.85, usual_weighs = 0.6;

// How far the tracker comes with a shot, in fields: less than it could, because of corners. After so many shots of its
// own its steps weigh as much as this.
constexpr double step_in_fields = 0.75, steps_that_convince = 2;

// A rectangle's longer side differs from the mean of both by at most so much of it.
constexpr double most_unequal = 0.8;

// A place of the zig-zag is planned, so the arm drives there while the scanner still computes; at the edge it waits for
// the frame that decides. So long a shot takes of what one at the edge does, until the zig-zag has a pace of its own.
constexpr double zigzag_pace = 0.7;

// After so many shots of its own the zig-zag's pace weighs as much as that of all before it.
constexpr double shots_that_convince = 2;

// Fields over a length that is only guessed: half a field more for the last one, which is there in full or not at all.
double spread_over(double length, double field, double overlap) {
  return length <= field ? 1 : 1.5 + (length - field) / (field - overlap);
}

double distance(const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  return std::hypot(a.x() - b.x(), a.y() - b.y());
}

}  // namespace

TimeLeft::TimeLeft(const TrackerSettings& tracker, const ScanPlanSettings& scan)
    : field_mm_{2 * std::min(tracker.field_half_x_mm, tracker.field_half_y_mm)}, scan_{scan} {}

void TimeLeft::begin(const Eigen::Vector2d& on_plate) {
  on_plate_ = first_ = last_ = on_plate;
  swept_ = swept_mm2_ = walked_mm_ = boundary_ = surface_ = taken_now_ = surface_taken_now_ = 0;
  planned_ = -1;
  last_spent_ = hal::Duration{0};
  surface_from_ = hal::Duration{-1};
  edge_found_ = closed_ = false;
}

void TimeLeft::took(const Shot& shot) {
  if (!shot.from_archive) {
    ++taken_now_;
    if (shot.purpose == hal::ShotPurpose::surface) {
      if (surface_from_ < hal::Duration{0}) surface_from_ = last_spent_;
      ++surface_taken_now_;
    }
    last_spent_ = shot.spent;
  }
  if (shot.purpose == hal::ShotPurpose::surface) ++surface_;
  if (shot.purpose == hal::ShotPurpose::seek) first_ = shot.centre;
  if (shot.purpose != hal::ShotPurpose::boundary) return;
  if (boundary_++ == 0) {
    first_ = last_ = shot.centre;
    return;
  }
  const double ax = last_.x() - on_plate_.x(), ay = last_.y() - on_plate_.y();
  const double bx = shot.centre.x() - on_plate_.x(), by = shot.centre.y() - on_plate_.y();
  swept_ += std::atan2(ax * by - ay * bx, ax * bx + ay * by);
  swept_mm2_ += (ax * by - ay * bx) / 2;
  walked_mm_ += distance(shot.centre, last_);
  last_ = shot.centre;
}

double TimeLeft::outline_done() const {
  return closed_ ? 1 : std::clamp(std::abs(swept_) / (2 * std::numbers::pi), 0.0, 1.0);
}

double TimeLeft::guessed_side() const {
  const double near = std::max(field_mm_ / 2, distance(first_, on_plate_));
  return std::pow(side_by_distance * near, 1 - usual_weighs) *
         std::pow(usual_fields * field_mm_, usual_weighs);
}

// What was seen of something that is `guess` in all, as if the rest went on like it.
double TimeLeft::in_all(double seen, double guess) const {
  const double done = outline_done(), guess_weighs = part_that_convinces * (1 - done);
  return (std::abs(seen) + guess_weighs * guess) / (done + guess_weighs);
}

double TimeLeft::perimeter() const { return in_all(walked_mm_, 4 * guessed_side()); }

double TimeLeft::boundary_shots() const {
  const double step = (walked_mm_ + steps_that_convince * step_in_fields * field_mm_) /
                      (std::max(0.0, boundary_ - 1) + steps_that_convince);
  return std::max({4.0, boundary_, perimeter() / step});
}

// Of the rectangle that has the outline's perimeter and area.
double TimeLeft::surface_shots() const {
  if (planned_ >= 0) return planned_;
  const double mean = perimeter() / 4, area = in_all(swept_mm2_, guessed_side() * guessed_side());
  const double differs = std::min(std::sqrt(std::max(0.0, mean * mean - area)), most_unequal * mean);
  const double margins = 2 * scan_.margin_mm;
  return spread_over(mean + differs + margins, scan_.field_x_mm, scan_.overlap_mm) *
         spread_over(mean - differs + margins, scan_.field_y_mm, scan_.overlap_mm);
}

hal::Duration TimeLeft::left(hal::Duration spent) const {
  if (taken_now_ < 1 || (!edge_found_ && planned_ < 0)) return hal::Duration{-1};
  const hal::Duration edge_spent = surface_from_ < hal::Duration{0} ? last_spent_ : surface_from_;
  const double edge_taken = taken_now_ - surface_taken_now_;
  const double pace = edge_taken > 0 ? static_cast<double>(edge_spent.count()) / edge_taken : 0;
  const double weight = edge_taken > 0 ? shots_that_convince : 0;  // of a run that was resumed in the zig-zag
  const double surface_pace =
      (static_cast<double>((last_spent_ - edge_spent).count()) + weight * zigzag_pace * pace) /
      (surface_taken_now_ + weight);
  const double boundary_left = closed_ ? 0 : boundary_shots() - boundary_;
  const double left = boundary_left * pace + std::max(0.0, surface_shots() - surface_) * surface_pace;
  const double since = std::min(static_cast<double>((spent - last_spent_).count()), surface_pace);
  return hal::Duration{static_cast<std::int64_t>(std::max(0.0, left - since))};
}

}  // namespace moldloft::tasks
