#include "tasks/machines/loop_closure.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace moldloft::tasks {
namespace {

constexpr double round_once = 2 * std::numbers::pi;
// Back at the anchor a walk has gone round once, or not at all; where the point lies in the hole itself, once the other
// way. Half a turn to either side tells them apart.
constexpr double least_round = 1.5 * std::numbers::pi, most_round_of_hole = 0.5 * std::numbers::pi;
constexpr double step_mm = 4;
constexpr double past_anchor = 0.5;  // rad: so far beyond the anchor nothing leads back to it
constexpr double away = 3;           // closing distances: farther than that the walk has left its beginning
// A walk that takes a step back comes by its beginning too, but goes round nothing.
constexpr double least_hole_mm2 = 400;

}  // namespace

LoopClosure::LoopClosure(const Eigen::Vector2d& anchor, const Eigen::Vector2d& on_plate, double close_mm)
    : anchor_{anchor}, on_plate_{on_plate}, last_{anchor}, close_mm_{close_mm} {}

LoopClosure::Verdict LoopClosure::go_on_to(const Eigen::Vector2d& p) {
  const double distance = (p - anchor_).norm();
  // Points lie closer than the boundary bends: most need no look, but those near the anchor.
  if ((p - last_).squaredNorm() < step_mm * step_mm && distance > away * close_mm_) return Verdict::open;
  const Eigen::Vector2d from = last_ - on_plate_, to = p - on_plate_;
  wound_ += std::atan2(from.x() * to.y() - from.y() * to.x(), from.dot(to));
  const Eigen::Vector2d before = last_ - anchor_, now = p - anchor_;
  area_mm2_ += (before.x() * now.y() - before.y() * now.x()) / 2;
  last_ = p;
  has_left_ |= distance > away * close_mm_;
  if (!has_left_) return Verdict::open;
  if (wound_ > least_round) nearest_mm_ = std::min(nearest_mm_, distance);
  if (distance < close_mm_ && wound_ > least_round) return Verdict::closed;
  if (distance < close_mm_ && wound_ < most_round_of_hole && area_mm2_ < -least_hole_mm2)
    return Verdict::hole;
  if (wound_ < -round_once - past_anchor) return Verdict::hole;
  return wound_ > round_once + past_anchor && distance > away * close_mm_ ? Verdict::beside : Verdict::open;
}

}  // namespace moldloft::tasks
