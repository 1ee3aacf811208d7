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

// Nothing that is pushed goes so far. The outline began at a hole, and the walk has left it for the plate's edge.
constexpr double far_off_mm = 50;

// How far inside the boundary the hint lies for finding the plate again: beyond the noise of an edge, within any plate.
constexpr double hint_inside_mm = 10;

}  // namespace

BoundaryTracker::BoundaryTracker(const TrackerSettings& settings) : settings_{settings} {
  edges_.reserve(settings.max_edge_points);
  corners_.reserve(settings.max_corners);
  corner_turns_.reserve(settings.max_corners);
}

std::size_t BoundaryTracker::bytes() const {
  return (edges_.capacity() + corners_.capacity()) * sizeof(Vector2d) +
         corner_turns_.capacity() * sizeof(double);
}

void BoundaryTracker::begin(const ShotPlace& start) {
  state_ = TrackState::seek_edge;
  counts_ = TrackContext{.max_seek_steps = settings_.max_seek_steps,
                         .max_half_steps = settings_.max_half_steps,
                         .max_turns = settings_.max_turns,
                         .max_backs = settings_.max_backs};
  start_ = start;
  counts_.max_heights = heights_within_limits();
  shots_ = 0;
  place_ = start;
  hint_ = front_ = start.centre;
  heading_ = {0, 1};
  filled_.reset();
  edges_.clear();
  corners_.clear();
  corner_turns_.clear();
}

BoundaryTracker::Step BoundaryTracker::take(const Seen& seen) {
  ++shots_;
  if (seen.plate_found) plate_z_mm_ = seen.plate_z_mm;
  Course course;
  Step step;
  step.event = observe(seen, course);
  step.from = step.to = state_;
  const auto* row = find_transition(track_transitions(), state_, step.event, counts_);
  if (row == nullptr) return step;
  step.action = row->action;
  step.to = state_ = row->to;
  if (step.to == TrackState::failed) {
    step.text = explain(step.action);
  } else if (step.to == TrackState::closed) {
    remember_edges(seen);
    remember_corners(course);
  } else {
    if (state_ == TrackState::track || state_ == TrackState::turn_head) remember_edges(seen);
    place_ = carry_out(step.action, course);
    step.next = place_;
  }
  return step;
}

// Half an outline would still close, and be believed: what the plan has no room for is never left out.
TrackEvent BoundaryTracker::observe(const Seen& seen, Course& course) {
  if (state_ == TrackState::seek_edge) return observe_plate(seen, course);
  if (seen.view.points.size() > edges_.capacity() - edges_.size()) return TrackEvent::beyond_plan;
  const TrackEvent event = observe_plate(seen, course);
  return event != TrackEvent::loop_closed && shots_ >= settings_.max_shots ? TrackEvent::beyond_plan : event;
}

TrackEvent BoundaryTracker::observe_plate(const Seen& seen, Course& course) {
  if (!seen.plate_found) return TrackEvent::no_plate;
  if (seen.view.plate_fills_field) {
    filled_ = place_.centre.head<2>();
    return TrackEvent::plate_fills_field;
  }
  if (seen.view.pieces.empty()) return TrackEvent::hidden;  // the plate ends, but between two stripes

  const bool outline_begun = state_ != TrackState::seek_edge && state_ != TrackState::first_side;
  const Vector2d from = outline_begun ? Vector2d{front_.head<2>()} : Vector2d{place_.centre.head<2>()};
  course = follow(seen, from);
  if (state_ == TrackState::first_side) {
    loop_ = LoopClosure{course.nearest.head<2>(), point_on_plate(course), settings_.close_mm};
    come_round(seen, course);
  }
  if (outline_begun) {
    if (const auto event = come_round(seen, course)) return *event;
    // What shows no more than the last shot did is looked at from elsewhere.
    if ((course.exit - front_).head<2>().norm() < settings_.progress_mm) return TrackEvent::hidden;
  }
  // What hides beyond a corner is another shot's matter: this one leads up to there.
  if (course.hides() && course.count > 1) {
    Course shorter = course;
    --shorter.count;
    end_at_last_piece(seen, shorter);
    if (!outline_begun || (shorter.exit - front_).head<2>().norm() >= settings_.progress_mm) course = shorter;
  }
  if (course.hides()) return TrackEvent::hidden;
  return course.has_corner() ? TrackEvent::corner : TrackEvent::side;
}

bool BoundaryTracker::Course::has_corner() const {
  return std::ranges::any_of(all(),
                             [](const auto* p) { return p->kind == geometry::BoundaryPiece::Kind::corner; });
}

Vector2d BoundaryTracker::Course::heading_at_nearest() const {
  const geometry::BoundaryPiece& piece = *pieces[0];
  const bool after_corner =
      piece.kind == geometry::BoundaryPiece::Kind::corner && nearest_index >= piece.points_before;
  return turn * (after_corner ? piece.tangent_last : piece.tangent_first);
}

// From the piece that passes nearest to `from` on.
BoundaryTracker::Course BoundaryTracker::follow(const Seen& seen, const Vector2d& from) const {
  Course best;
  double best_distance = INFINITY;
  const auto& motion = seen.world_from_scanner;
  for (const auto& piece : seen.view.pieces) {
    for (std::uint32_t i = 0; i < piece.count; ++i) {
      const Vector3d p = motion * seen.view.points[piece.first + i].position;
      const double distance = (p.head<2>() - from).norm();
      if (distance >= best_distance) continue;
      best_distance = distance;
      best.pieces[0] = &piece;
      best.nearest = p;
      best.nearest_index = i;
    }
  }
  best.count = 1;
  for (const auto* last = best.pieces[0]; last->goes_on && best.count < Course::most_pieces;) {
    const auto next =
        std::ranges::find(seen.view.pieces, last->first + last->count, &geometry::BoundaryPiece::first);
    if (next == seen.view.pieces.end()) break;
    last = best.pieces[best.count++] = &*next;
  }
  best.turn = motion.linear().topLeftCorner<2, 2>();
  best.offset = motion.translation().head<2>();
  best.tangent_first = best.turn * best.pieces[0]->tangent_first;
  end_at_last_piece(seen, best);
  return best;
}

void BoundaryTracker::end_at_last_piece(const Seen& seen, Course& course) const {
  const auto* last = course.pieces[course.count - 1];
  course.exit = seen.world_from_scanner * seen.view.points[last->first + last->count - 1].position;
}

// Whether the boundary, once round, passes where it began, or beside that place, or goes round a hole.
std::optional<TrackEvent> BoundaryTracker::come_round(const Seen& seen, Course& course) {
  course.loop = loop_;
  for (const auto* piece : course.all()) {
    for (std::uint32_t i = piece == course.pieces[0] ? course.nearest_index : 0; i < piece->count; ++i) {
      const Vector2d p = (seen.world_from_scanner * seen.view.points[piece->first + i].position).head<2>();
      course.farthest_x_mm = std::max(course.farthest_x_mm, p.x());
      switch (course.loop.go_on_to(p)) {
        case LoopClosure::Verdict::open:
          break;
        case LoopClosure::Verdict::closed:
          return TrackEvent::loop_closed;
        case LoopClosure::Verdict::beside:
          loop_ = course.loop;
          counts_.is_far_off = loop_.beside_mm() > far_off_mm;
          return TrackEvent::passes_beside;
        case LoopClosure::Verdict::hole:
          return TrackEvent::hole_closed;
      }
    }
  }
  return std::nullopt;
}

// A place whose field the plate filled; where none did, inside of the edge that the outline begins at.
Vector2d BoundaryTracker::point_on_plate(const Course& course) const {
  if (filled_) return *filled_;
  return course.nearest.head<2>() + hint_inside_mm * left_of(course.heading_at_nearest());
}

void BoundaryTracker::remember_edges(const Seen& seen) {
  for (const auto& point : seen.view.points)
    hal::add_within_reserve(edges_, (seen.world_from_scanner * point.position).head<2>());
}

void BoundaryTracker::remember_corners(const Course& course) {
  for (const auto* piece : course.all()) {
    if (piece->kind == geometry::BoundaryPiece::Kind::corner)
      remember_corner(course.turn * piece->corner + course.offset, std::abs(piece->turn));
  }
}

void BoundaryTracker::remember_corner(const Vector2d& corner, double turn) {
  const auto known = std::ranges::find_if(
      corners_, [&](const Vector2d& c) { return (c - corner).norm() <= settings_.corner_merge_mm; });
  if (known != corners_.end()) {
    *known = corner;  // the later look has the corner nearer to the middle of the field
  } else if (corners_.size() < settings_.max_corners) {
    hal::add_within_reserve(corners_, corner);
    hal::add_within_reserve(corner_turns_, turn);
  } else if (const auto bluntest = std::ranges::min_element(corner_turns_); *bluntest < turn) {
    corners_[static_cast<std::size_t>(bluntest - corner_turns_.begin())] = corner;
    *bluntest = turn;
  }
}

void BoundaryTracker::move_front(const Course& course) {
  heading_ = course.turn * course.pieces[course.count - 1]->tangent_last;
  front_ = course.exit;
  loop_ = course.loop;
  farthest_x_mm_ = std::max(farthest_x_mm_, course.farthest_x_mm);
}

// Where to look next while no edge has been seen.
ShotPlace BoundaryTracker::seek_on(TrackAction action) {
  ShotPlace next = place_;
  switch (action) {
    case TrackAction::step_along_x:
      ++counts_.seek_steps;
      // The plate filled this field, so it is certain along the field's border, within which it may have holes; beyond
      // it may end.
      hint_ = corner_of_field_along_x();
      next.centre.z() = plate_z_mm_;
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
    case TrackAction::look_past_hole:
      // The hole lies within the field; what is certain is the plate along the field's border.
      ++counts_.seek_steps;
      hint_ = corner_of_field_along_x();
      next = {.centre = hint_, .head_yaw = start_.head_yaw};
      next.centre.x() += settings_.field_half_x_mm - hint_inside_mm;
      break;
    case TrackAction::leave_hole:
      // Beyond it, so that it is not found again.
      ++counts_.seek_steps;
      edges_.clear(), corners_.clear(), corner_turns_.clear();
      next = {.centre = {farthest_x_mm_ + settings_.field_half_x_mm + hint_inside_mm, start_.centre.y(),
                         plate_z_mm_},
              .head_yaw = start_.head_yaw};
      hint_ = next.centre;
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

// Of the field at hand, the corner that lies farthest along x; a little inside.
Vector3d BoundaryTracker::corner_of_field_along_x() const {
  const double c = std::cos(place_.head_yaw), s = std::sin(place_.head_yaw);
  Vector3d farthest = place_.centre;
  for (const double way_x : {-1.0, 1.0}) {
    for (const double way_y : {-1.0, 1.0}) {
      const double x = way_x * (settings_.field_half_x_mm - hint_inside_mm),
                   y = way_y * (settings_.field_half_y_mm - hint_inside_mm / 2);
      const Vector3d corner = place_.centre + Vector3d{c * x - s * y, s * x + c * y, 0};
      if (corner.x() > farthest.x()) farthest = corner;
    }
  }
  farthest.z() = plate_z_mm_;
  return farthest;
}

ShotPlace BoundaryTracker::carry_out(TrackAction action, const Course& course) {
  const double stripe = place_.head_yaw + pi / 2;
  ShotPlace next = place_;
  switch (action) {
    case TrackAction::step_along_x:
    case TrackAction::step_half_along_x:
    case TrackAction::change_height:
    case TrackAction::look_past_hole:
    case TrackAction::leave_hole:
      return seek_on(action);
    case TrackAction::centre_on_edge:
      heading_ = course.tangent_first;
      front_ = course.nearest;
      counts_.turns = 0;
      next = {.centre = course.nearest, .head_yaw = healthy_yaw(place_.head_yaw)};
      break;
    case TrackAction::begin_again:
      // From here on, once more round.
      ++counts_.rounds;
      edges_.clear(), corners_.clear(), corner_turns_.clear();
      loop_ = LoopClosure{course.nearest.head<2>(), point_on_plate(course), settings_.close_mm};
      remember_corners(course);
      heading_ = course.turn * course.pieces[course.count - 1]->tangent_last;
      front_ = course.exit;
      counts_.turns = counts_.backs = 0;
      next = ahead();
      break;
    case TrackAction::begin_outline:
      heading_ = course.heading_at_nearest();
      farthest_x_mm_ = course.nearest.x();
      [[fallthrough]];
    case TrackAction::advance:
      remember_corners(course);
      move_front(course);
      counts_.turns = counts_.backs = 0;
      next = ahead();
      break;
    case TrackAction::turn: {
      ++counts_.turns;
      const bool following = state_ != TrackState::seek_edge && state_ != TrackState::first_side;
      if (course.count > 0 && following) {
        move_front(course);
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
      const double z = start_.centre.z() + way * storey * settings_.storey_mm;
      if (z < settings_.lowest_z_mm || z > settings_.highest_z_mm) continue;
      if (found++ == count) return z;
    }
  }
  return start_.centre.z();
}

int BoundaryTracker::heights_within_limits() const {
  int count = 0;
  while (count < settings_.max_heights && height_to_try(count) != start_.centre.z()) ++count;
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
    case TrackAction::report_open:
      return hal::Message::format(
          "the edge comes round {:.0f} mm beside its beginning at x {:.0f} y {:.0f} mm: plate or arm was "
          "moved, "
          "the rim is ragged, or [scanner.mount] is wrong",
          loop_.beside_mm(), loop_.anchor().x(), loop_.anchor().y());
    case TrackAction::report_too_large:
      return hal::Message::format(
          "outline not closed after {} shots, {} edge points of it stored: raise [plate] largest_mm", shots_,
          edges_.size());
    default:
      return hal::Message::format(
          "boundary lost at x {:.0f} y {:.0f} mm: clear that edge of the plate, see that nothing was moved, "
          "and run again",
          front_.x(), front_.y());
  }
}

}  // namespace moldloft::tasks
