#include "tasks/machines/boundary_tracker.hpp"

#include "hal/base/reserved.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace moldloft::tasks {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using geometry::wrapped_angle;

constexpr double pi = std::numbers::pi;

double angle_of(const Vector2d& v) { return std::atan2(v.y(), v.x()); }
Vector2d left_of(const Vector2d& v) { return {-v.y(), v.x()}; }

// How far two undirected lines are from parallel: 0 to pi / 2.
double crossing_angle(double a, double b) {
  const double d = std::abs(wrapped_angle(a - b));
  return std::min(d, pi - d);
}

// The yaw congruent to `wanted` modulo half a turn that is nearest to `now`: stripes look the same from both sides.
double nearest_half_turn(double wanted, double now) {
  const double d = wrapped_angle(2 * (wanted - now)) / 2;
  return now + d;
}

// A plate's outline turns by a full circle; the last corner may lie behind the point where it began.
constexpr double min_turn_of_a_loop = 2 * pi - 0.8;

// How far inside the boundary the hint lies for finding the plate again: beyond the noise of an edge, within any plate.
constexpr double hint_inside_mm = 10;

}  // namespace

BoundaryTracker::BoundaryTracker(const TrackerSettings& settings) : settings_{settings} {
  edges_.reserve(settings.max_edge_points);
  corners_.reserve(static_cast<std::size_t>(settings.max_shots));  // each shot shows one of them at most
}

std::size_t BoundaryTracker::bytes() const {
  return (edges_.capacity() + corners_.capacity()) * sizeof(Vector2d);
}

void BoundaryTracker::begin(const ShotPlace& start) {
  state_ = TrackState::seek_edge;
  counts_ = TrackContext{.max_seek_steps = settings_.max_seek_steps,
                         .max_half_steps = settings_.max_half_steps,
                         .max_turns = settings_.max_turns,
                         .max_backs = settings_.max_backs};
  start_z_mm_ = start.centre.z();
  counts_.max_heights = heights_within_limits();
  shots_ = 0;
  place_ = start;
  hint_ = front_ = start.centre;
  heading_ = {0, 1};
  turned_ = 0;
  edges_.clear();
  corners_.clear();
}

BoundaryTracker::Step BoundaryTracker::take(const Seen& seen) {
  ++shots_;
  if (seen.plate_found) plate_z_mm_ = seen.plate_z_mm;
  Piece piece;
  Step step;
  step.event = observe(seen, piece);
  step.from = step.to = state_;
  const auto* row = find_transition(track_transitions(), state_, step.event, counts_);
  if (row == nullptr) return step;
  step.action = row->action;
  step.to = state_ = row->to;
  if (step.to == TrackState::failed) {
    step.text = explain(step.action);
  } else if (step.to == TrackState::closed) {
    remember_edges(seen);
    if (piece.piece->kind == geometry::BoundaryPiece::Kind::corner) remember_corner(piece.corner);
  } else {
    if (state_ == TrackState::track || state_ == TrackState::turn_head) remember_edges(seen);
    place_ = carry_out(step.action, piece);
    step.next = place_;
  }
  return step;
}

// Half an outline would still close, and be believed: what the plan has no room for is never left out.
TrackEvent BoundaryTracker::observe(const Seen& seen, Piece& piece) {
  if (state_ == TrackState::seek_edge) return observe_plate(seen, piece);
  if (seen.view.points.size() > edges_.capacity() - edges_.size()) return TrackEvent::beyond_plan;
  const TrackEvent event = observe_plate(seen, piece);
  return event != TrackEvent::loop_closed && shots_ >= settings_.max_shots ? TrackEvent::beyond_plan : event;
}

TrackEvent BoundaryTracker::observe_plate(const Seen& seen, Piece& piece) {
  if (!seen.plate_found) return TrackEvent::no_plate;
  if (seen.view.plate_fills_field) return TrackEvent::plate_fills_field;
  if (seen.view.pieces.empty()) return TrackEvent::hidden;  // the plate ends, but between two stripes

  const bool outline_begun = state_ != TrackState::seek_edge && state_ != TrackState::first_side;
  const Vector2d from = outline_begun ? Vector2d{front_.head<2>()} : Vector2d{place_.centre.head<2>()};
  piece = follow(seen, from);
  if (outline_begun) {
    const double turned = turned_ + wrapped_angle(angle_of(piece.tangent_last) - angle_of(heading_));
    if (turned > min_turn_of_a_loop && passes_anchor(seen, piece)) return TrackEvent::loop_closed;
  }
  if (piece.piece->hidden_last) return TrackEvent::hidden;
  return piece.piece->kind == geometry::BoundaryPiece::Kind::corner ? TrackEvent::corner : TrackEvent::side;
}

// The piece of the boundary that passes nearest to `from`.
BoundaryTracker::Piece BoundaryTracker::follow(const Seen& seen, const Vector2d& from) const {
  Piece best;
  double best_distance = INFINITY;
  const auto& motion = seen.world_from_scanner;
  for (const auto& piece : seen.view.pieces) {
    for (std::uint32_t i = 0; i < piece.count; ++i) {
      const Vector3d p = motion * seen.view.points[piece.first + i].position;
      const double distance = (p.head<2>() - from).norm();
      if (distance >= best_distance) continue;
      best_distance = distance;
      best.piece = &piece;
      best.nearest = p;
      best.nearest_index = i;
    }
  }
  const Eigen::Matrix2d turn = motion.linear().topLeftCorner<2, 2>();
  best.exit = motion * seen.view.points[best.piece->first + best.piece->count - 1].position;
  best.tangent_first = turn * best.piece->tangent_first;
  best.tangent_last = turn * best.piece->tangent_last;
  best.corner = turn * best.piece->corner + motion.translation().head<2>();
  return best;
}

bool BoundaryTracker::passes_anchor(const Seen& seen, const Piece& piece) const {
  for (std::uint32_t i = 0; i < piece.piece->count; ++i) {
    const Vector3d p = seen.world_from_scanner * seen.view.points[piece.piece->first + i].position;
    if ((p.head<2>() - anchor_).norm() < settings_.close_mm) return true;
  }
  return false;
}

void BoundaryTracker::remember_edges(const Seen& seen) {
  for (const auto& point : seen.view.points)
    hal::add_within_reserve(edges_, (seen.world_from_scanner * point.position).head<2>());
}

void BoundaryTracker::remember_corner(const Vector2d& corner) {
  for (auto& known : corners_) {
    if ((known - corner).norm() > settings_.corner_merge_mm) continue;
    known = corner;  // the later look has the corner nearer to the middle of the field
    return;
  }
  hal::add_within_reserve(corners_, corner);
}

void BoundaryTracker::move_front(const Piece& piece) {
  turned_ += wrapped_angle(angle_of(piece.tangent_last) - angle_of(heading_));
  heading_ = piece.tangent_last;
  front_ = piece.exit;
}

// Where to look next while no edge has been seen.
ShotPlace BoundaryTracker::seek_on(TrackAction action) {
  ShotPlace next = place_;
  switch (action) {
    case TrackAction::step_along_x:
      ++counts_.seek_steps;
      // The plate filled this field, so it is certain just inside the field's far border; beyond it may end.
      next.centre.z() = plate_z_mm_;
      hint_ = next.centre;
      hint_.x() += std::min(settings_.field_half_x_mm, settings_.field_half_y_mm) - hint_inside_mm;
      next.centre.x() += settings_.seek_step_mm;
      break;
    case TrackAction::step_half_along_x:
      // What hides at this field's border lies inside the next.
      ++counts_.half_steps;
      counts_.turns = 0;
      hint_ = next.centre;
      hint_.z() = next.centre.z() = plate_z_mm_;
      next.centre.x() += settings_.seek_step_mm / 2;
      break;
    case TrackAction::change_height:
      next.centre.z() = height_to_try(counts_.heights++);
      hint_ = next.centre;
      break;
    default:
      break;
  }
  return next;
}

ShotPlace BoundaryTracker::carry_out(TrackAction action, const Piece& piece) {
  const double stripe = place_.head_yaw + pi / 2;
  ShotPlace next = place_;
  switch (action) {
    case TrackAction::step_along_x:
    case TrackAction::step_half_along_x:
    case TrackAction::change_height:
      return seek_on(action);
    case TrackAction::centre_on_edge:
      heading_ = piece.tangent_first;
      front_ = piece.nearest;
      counts_.turns = 0;
      next = {.centre = piece.nearest, .head_yaw = healthy_yaw(place_.head_yaw)};
      break;
    case TrackAction::begin_outline: {
      const bool after_corner = piece.piece->kind == geometry::BoundaryPiece::Kind::corner &&
                                piece.nearest_index >= piece.piece->points_before;
      anchor_ = piece.nearest.head<2>();
      heading_ = after_corner ? piece.tangent_last : piece.tangent_first;
      turned_ = 0;
      [[fallthrough]];
    }
    case TrackAction::advance:
      if (piece.piece->kind == geometry::BoundaryPiece::Kind::corner) remember_corner(piece.corner);
      move_front(piece);
      counts_.turns = counts_.backs = 0;
      next = ahead();
      break;
    case TrackAction::turn: {
      ++counts_.turns;
      const bool following = state_ != TrackState::seek_edge && state_ != TrackState::first_side;
      if (piece.piece != nullptr && following) {
        move_front(piece);
        next.centre = front_;
      }
      if (!following) {
        // The same place, and the plate was found from the same hint. Whatever hides runs along the stripes.
        next.head_yaw += settings_.crossing;
        return next;
      }
      // What hides runs along the stripes: cross it and the side that was seen equally well. Should that show nothing
      // either, the guess was wrong, and a third of a turn looks from elsewhere.
      next.head_yaw = nearest_half_turn(
          counts_.turns == 1 ? yaw_crossing_both(angle_of(heading_), stripe) : place_.head_yaw + pi / 3,
          place_.head_yaw);
      break;
    }
    case TrackAction::back_up:
      ++counts_.backs;
      next.centre = front_;
      next.centre.head<2>() -= 10.0 * counts_.backs * heading_;
      break;
    default:
      return next;
  }
  hint_ = front_;
  hint_.head<2>() += hint_inside_mm * left_of(heading_);
  return next;
}

// The next field, centred on the boundary's continuation so far ahead that the front lies `overlap_mm` inside it.
ShotPlace BoundaryTracker::ahead() const {
  ShotPlace next;
  next.head_yaw = healthy_yaw(place_.head_yaw);
  const double along = wrapped_angle(angle_of(heading_) - next.head_yaw);
  const double reach = std::min(settings_.field_half_x_mm / std::max(std::abs(std::cos(along)), 1e-9),
                                settings_.field_half_y_mm / std::max(std::abs(std::sin(along)), 1e-9));
  next.centre = front_;
  next.centre.head<2>() += (reach - settings_.overlap_mm) * heading_;
  return next;
}

// Keeps the yaw while the stripes cross the boundary well; otherwise the nearest yaw at which they do.
double BoundaryTracker::healthy_yaw(double yaw) const {
  const double boundary = angle_of(heading_);
  if (crossing_angle(yaw + pi / 2, boundary) >= settings_.min_crossing) return yaw;
  const double plus = nearest_half_turn(boundary + settings_.crossing - pi / 2, yaw);
  const double minus = nearest_half_turn(boundary - settings_.crossing - pi / 2, yaw);
  return std::abs(plus - yaw) <= std::abs(minus - yaw) ? plus : minus;
}

// The yaw whose stripes stay as far as possible from parallel to both directions: across the middle between them.
double BoundaryTracker::yaw_crossing_both(double heading, double stripe) const {
  const double middle = heading + wrapped_angle(2 * (stripe - heading)) / 4;
  const double a = middle, b = middle + pi / 2;
  const auto worst = [&](double direction) {
    return std::min(crossing_angle(direction, heading), crossing_angle(direction, stripe));
  };
  return (worst(a) >= worst(b) ? a : b) - pi / 2;
}

// Above, below, two above, and so on, as far as the arm goes: the count-th of them.
double BoundaryTracker::height_to_try(int count) const {
  int found = 0;
  for (int storey = 1; storey <= 2 * settings_.max_heights; ++storey) {
    for (const int way : {1, -1}) {
      const double z = start_z_mm_ + way * storey * settings_.storey_mm;
      if (z < settings_.lowest_z_mm || z > settings_.highest_z_mm) continue;
      if (found++ == count) return z;
    }
  }
  return start_z_mm_;
}

int BoundaryTracker::heights_within_limits() const {
  int count = 0;
  while (count < settings_.max_heights && height_to_try(count) != start_z_mm_) ++count;
  return count;
}

hal::Message BoundaryTracker::explain(TrackAction action) const {
  const double x = place_.centre.x(), y = place_.centre.y();
  switch (action) {
    case TrackAction::report_off_plate:
      return hal::Message::format(
          "no plate under the scanner at x {:.0f} y {:.0f} mm, looked for at {} heights: move [start] onto "
          "the plate",
          x, y, counts_.heights + 1);
    case TrackAction::report_no_edge:
      return hal::Message::format(
          "no edge from the start pose to x {:.0f} mm: is [start] on the plate to measure?", x);
    case TrackAction::report_hidden:
      return hal::Message::format(
          "boundary hidden between stripes at x {:.0f} y {:.0f} mm in {} directions: look at the edge there",
          x, y, counts_.turns + 1);
    case TrackAction::report_too_large:
      return hal::Message::format(
          "outline not closed after {} shots, {} edge points of it stored: raise [plate] largest_mm", shots_,
          edges_.size());
    default:
      return hal::Message::format(
          "boundary lost at x {:.0f} y {:.0f} mm: clear that edge of the plate and run again", front_.x(),
          front_.y());
  }
}

}  // namespace moldloft::tasks
