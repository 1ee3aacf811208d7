#include "tasks/cell/measurement.hpp"

#include "hal/base/reserved.hpp"
#include "tasks/cell/blind_band.hpp"
#include "tasks/planning/flaw_words.hpp"
#include "tasks/planning/tool_pose.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace moldloft::tasks {

using hal::ShotPurpose;
using Stage = SurfaceTask::Stage;

namespace {

// Every so many plate points one goes into the rough height model: a few of each shot are plenty for six coefficients.
constexpr std::uint32_t height_stride = 20;

// How far the hint may be off once the plate has been seen: a field's width at 10 degrees.
constexpr double hint_reach_mm = 18;

// How far inside the outline the hint of a surface shot lies, when the field's centre is outside.
constexpr double hint_inside_mm = 10;

// A point that was seen so near to the tracker's hint is a better one.
constexpr double seen_near_mm = 8;

// Between a known point of the plate and the field's border: what is nearer may lie beyond it in the frame.
constexpr double hint_margin_mm = 3;

// Of the depth range: how far the plate may lie from where the boundary lets expect it before a field is raised to it.
constexpr double raise_share = 1.0 / 6;

// Of the depth range: how far a field is raised to see what has left it. The rest is overlap.
constexpr double next_storey_share = 1.7;

// A place is visited so often at most: as planned, above, below.
constexpr int most_visits = 3;

// So many stripes must leave the depth range before a place is visited for their sake: one may be a reflection.
constexpr int few_stripes = 2;

double cross(const Eigen::Vector2d& a, const Eigen::Vector2d& b) { return a.x() * b.y() - a.y() * b.x(); }

bool inside_quad(const std::array<Eigen::Vector2d, 4>& corners, const Eigen::Vector2d& p) {
  for (std::size_t i = 0; i < 4; ++i) {
    if (cross(corners[(i + 1) % 4] - corners[i], p - corners[i]) < 0) return false;
  }
  return true;
}

}  // namespace

Measurement::Measurement(const CellSettings& settings, Supervisor& supervisor, SurfaceTask& surface,
                         ShotTaker& shots)
    : settings_{settings},
      supervisor_{supervisor},
      surface_{surface},
      shots_{shots},
      tracker_{settings.tracker},
      view_{settings.max_stripes, settings.max_points, settings.view},
      evidence_{
          {.max_shots = static_cast<std::size_t>(settings.tracker.max_shots) + 1 + settings.max_surface_shots,
           .field_x_mm = settings.scan.field_x_mm,
           .field_y_mm = settings.scan.field_y_mm}},
      surface_places_(settings.max_surface_shots),
      time_left_{settings.tracker, settings.scan} {
  boundary_places_.reserve(static_cast<std::size_t>(settings.tracker.max_shots) + 1);
}

// The background work outlives the cell, so it must let go of the view and of the frame.
Measurement::~Measurement() { surface_.begin(); }

std::size_t Measurement::plan_bytes() const {
  return view_.bytes() + tracker_.bytes() + evidence_.bytes() +
         (boundary_places_.capacity() + surface_places_.capacity()) * sizeof(ShotPlace);
}

void Measurement::begin() { apply(PhaseEvent::begin); }

void Measurement::forget() {
  accepted_ = false;
  frame_is_lost();
  apply(PhaseEvent::forget);
}

// Tells the table what the background work has come to. The tracker's part of the events comes from track().
void Measurement::step() {
  if (surface_.stage() == Stage::failed)
    return apply(PhaseEvent::flaw, {.beyond_plan = surface_.error() == geometry::Error::capacity});
  switch (phase_) {
    case Phase::plan_scan:
      if (!surface_.outline_ready()) return;
      if (!plan_begun_) return apply(PhaseEvent::outline_ready);
      if (!surface_.planning()) apply(PhaseEvent::zigzag_ready, {.beyond_plan = !zigzag_.result()});
      return;
    case Phase::scan_surface:
      if (surface_next_ == surface_planned_ && shots_.is_done() && !look_.is_held() &&
          surface_.stage() == Stage::open)
        apply(PhaseEvent::all_taken);
      return;
    case Phase::finish_fit:
      if (surface_.stage() == Stage::ready) apply(PhaseEvent::surface_ready);
      return;
    default:
      return;
  }
}

void Measurement::apply(PhaseEvent event, const PhaseContext& context) {
  const auto* row = find_transition(phase_transitions(), phase_, event, context);
  if (row == nullptr) return;
  if (row->to != phase_) supervisor_.record("phase", "", to_string(phase_), to_string(row->to));
  phase_ = row->to;
  carry_out(row->action);
}

void Measurement::carry_out(PhaseAction action) {
  switch (action) {
    case PhaseAction::seek:
      return seek();
    case PhaseAction::note_edge:
      return time_left_.edge_is_found();
    case PhaseAction::build_outline:
      return build_outline();
    case PhaseAction::plan_zigzag:
      return plan_zigzag();
    case PhaseAction::scan:
      return scan();
    case PhaseAction::solve:
      return surface_.solve();
    case PhaseAction::finish:
      surface_ready_ = supervisor_.now();
      return supervisor_.done();
    case PhaseAction::report_too_many_shots:
      return supervisor_.hold(HoldCause::plan,
                              "the plate needs more shots than are planned for: raise [plate] largest_mm");
    case PhaseAction::report_too_large:
      return hold_for_flaw(HoldCause::plan);
    case PhaseAction::report_flaw:
      return hold_for_flaw(HoldCause::measurement);
    case PhaseAction::none:
      return;
  }
}

void Measurement::seek() {
  boundary_places_.clear();
  surface_planned_ = surface_next_ = 0;
  plan_begun_ = false;
  heights_.reset();
  evidence_.begin();
  health_ = last_seen_ = {};
  has_seen_ = false;
  spent_ = hal::Duration{0};
  time_left_.begin(settings_.start.centre.head<2>());
  surface_.begin();
  tracker_.begin(settings_.start);
  shots_.order(settings_.start, ShotPurpose::seek);
}

void Measurement::build_outline() {
  heights_.solve();
  time_left_.boundary_is_closed();
  surface_.build_outline(tracker_.edge_points(), tracker_.corners());
}

// Planning the zig-zag takes longer than a tick, so it runs in the slack.
void Measurement::plan_zigzag() {
  const auto& last = boundary_places_.back();
  zigzag_.begin(surface_.outline(), heights_, settings_.scan, last.centre.head<2>(), last.head_yaw,
                surface_places_);
  surface_.plan(zigzag_);
  plan_begun_ = true;
}

void Measurement::scan() {
  surface_planned_ = *zigzag_.result();
  surface_next_ = 0;
  order_next();
}

void Measurement::hold_for_flaw(HoldCause cause) {
  hold_for_plate(cause, flaw_words(surface_.error(), surface_.outline_search(), tracker_.edge_points()));
}

// The background work finds the plate in the frame, and may begin before all of it is there. use_view() follows when
// that is done and the frame is whole.
void Measurement::frame_comes(const ShotOrder& order, const hal::Frame& frame, hal::Scanner* unpacks) {
  looked_at_ = order;
  const geometry::RigidMotion world_from_scanner =
      scanner_motion_at(order.reported, settings_.tip_from_scanner);
  // Nobody knows the plate's height before it was seen. From then on the hint is as good as a step's slope allows.
  const double reach = order.purpose == ShotPurpose::seek ? settings_.depth_mm : hint_reach_mm;
  view_.begin(frame,
              {.hint = into_scanner(world_from_scanner, hint_in_world(order)),
               .reach_mm = reach,
               .boundary = order.purpose != ShotPurpose::surface},
              unpacks);
  surface_.look(view_);
  look_ = frame_.lend();
  accepted_ = false;
}

// The frame will not become whole, so what was seen of it counts for nothing.
void Measurement::frame_is_lost() {
  if (!look_.is_held() || accepted_) return;
  surface_.stop_looking();
  look_.end();
}

void Measurement::frame_is_whole(const ShotOrder& order, const hal::Frame& frame, hal::Scanner* unpacks,
                                 bool of_earlier_run) {
  if (!look_.is_held()) frame_comes(order, frame, unpacks);
  accepted_ = true;
  ++taken_[static_cast<std::size_t>(looked_at_.purpose)];
  points_seen_ += frame.point_count;
  time_left_.took({.purpose = looked_at_.purpose,
                   .centre = looked_at_.place.centre.head<2>(),
                   .spent = spent_,
                   .from_archive = of_earlier_run});
}

// The next frame overwrites the last one, so nobody may read that any more, and the surface must be ready for points.
bool Measurement::takes_frame() const { return frame_.is_free() && !surface_.prepares(); }

void Measurement::use_view() {
  if (look_.is_held() && accepted_ && !surface_.looking()) use_shot(std::move(look_));
}

// No two exposures have the same noise: the same heights again are the same frame again.
bool Measurement::is_of_a_sound_scanner() {
  const FrameHealth before = std::exchange(health_, health_of(view_.frame()));
  if (!is_blind(health_)) has_seen_ = true, last_seen_ = health_;
  if (health_.noise_mm == 0 || health_.fingerprint != before.fingerprint) return true;
  supervisor_.hold(HoldCause::measurement,
                   hal::Message::format("the scanner sends the same frame again (shot {}): restart it, then "
                                        "begin a new run",
                                        looked_at_.number));
  return false;
}

// A plate that cannot be tracked is no news where the scanner itself is at fault. One empty frame is no fault: it may
// look beside the plate.
void Measurement::hold_for_plate(HoldCause cause, const hal::Message& what) {
  auto fault = scanner_fault(has_seen_ ? last_seen_ : health_, settings_.view.runs.noise_mm);
  if (!fault) {
    if (const auto band = blind_band(evidence_.evidence(), settings_.scan.field_y_mm))
      fault = hal::Message::format(
          "from shot {} on the scanner shows no points in {:.0f} % of its field, all on one side: look at "
          "its "
          "window and shutter",
          evidence_.evidence().shots[band->shot].number, 100 * band->share(settings_.scan.field_y_mm));
  }
  supervisor_.hold(fault ? HoldCause::measurement : cause, fault.value_or(what));
}

void Measurement::use_shot(FrameLease lease) {
  if (!is_of_a_sound_scanner()) return;
  const geometry::RigidMotion world_from_scanner =
      scanner_motion_at(looked_at_.reported, settings_.tip_from_scanner);
  if (looked_at_.purpose == ShotPurpose::surface) {
    keep_evidence(world_from_scanner, view_.found());
    if (view_.found()) surface_.fold(view_, world_from_scanner, std::move(lease));
    return look_again_where_plate_is();
  }
  hal::add_within_reserve(boundary_places_, looked_at_.place);
  const std::optional<double> height = view_.found() ? learn_heights(world_from_scanner) : std::nullopt;
  track(looked_at_, world_from_scanner, height);
  keep_evidence(world_from_scanner, height.has_value());
  if (height) surface_.keep(view_, world_from_scanner, std::move(lease));
}

void Measurement::keep_evidence(const geometry::RigidMotion& world_from_scanner, bool plate_found) {
  evidence_.add({.number = looked_at_.number,
                 .purpose = looked_at_.purpose,
                 .place = looked_at_.place,
                 .world_from_scanner = world_from_scanner,
                 .plate_found = plate_found},
                view_);
}

// Adds the shot's heights to the rough model and gives their mean. Gives nothing when the scanner saw the table alone.
std::optional<double> Measurement::learn_heights(const geometry::RigidMotion& world_from_scanner) {
  HeightModel learnt = heights_;
  double sum = 0;
  int count = 0;
  std::array<Eigen::Vector3d, 64> points;
  view_.rewind({.stripe_stride = height_stride, .point_stride = height_stride});
  for (std::size_t n = view_.next(points); n > 0; n = view_.next(points)) {
    for (std::size_t i = 0; i < n; ++i) {
      const Eigen::Vector3d p = world_from_scanner * points[i];
      learnt.add(p);
      sum += p.z();
      ++count;
    }
  }
  if (count == 0 || sum / count < settings_.lowest_plate_z_mm) return std::nullopt;
  heights_ = learnt;
  return sum / count;
}

// What earlier shots have seen of the plate in a field, or in one of so many times its size.
std::optional<Eigen::Vector3d> Measurement::known_in_field(const ShotPlace& place, double times) const {
  const auto half = [&](double field_mm) { return times * (field_mm / 2 - hint_margin_mm); };
  return evidence_.known_near(place, half(settings_.scan.field_x_mm), half(settings_.scan.field_y_mm));
}

// The boundary alone does not tell how high a wavy plate's middle lies; the shots beside this one do.
ShotPlace Measurement::raised_to_plate(ShotPlace place) const {
  const auto known = known_in_field(place, 1);
  if (!known) return place;
  const double above = known->z() - heights_.at(known->x(), known->y());
  if (std::abs(above) > raise_share * settings_.depth_mm) place.centre.z() += above;
  return place;
}

int Measurement::visits_of(const ShotPlace& place) const {
  const auto& shots = evidence_.evidence().shots;
  return static_cast<int>(std::ranges::count_if(shots, [&](const ShotSeen& shot) {
    return shot.purpose == ShotPurpose::surface &&
           (shot.place.centre - place.centre).head<2>().squaredNorm() < 1;
  }));
}

// A surface shot that shows no plate, or a plate that leaves the depth range, is taken again at another height.
void Measurement::look_again_where_plate_is() {
  ShotPlace again = looked_at_.place;
  if (visits_of(again) >= most_visits) return;
  if (!evidence_.evidence().shots.back().plate_found) {
    const auto known = known_in_field(again, 2);
    if (!known || std::abs(known->z() - again.centre.z()) < hint_reach_mm) return;
    again.centre.z() = known->z();
  } else {
    const auto out = evidence_.last_out_of_depth();
    const int more = std::max(out.above, out.below);
    if (more < few_stripes) return;
    again.centre.z() += (out.above > out.below ? 1 : -1) * next_storey_share * settings_.depth_mm;
  }
  if (visit_again(again) && shots_.is_done()) order_next();
}

Eigen::Vector3d Measurement::hint_in_world(const ShotOrder& order) const {
  if (order.purpose != ShotPurpose::surface) {
    // A centimetre inside its edge a steep plate lies elsewhere, the table perhaps nearer: what was seen there knows.
    const Eigen::Vector3d hint = tracker_.plate_hint();
    return evidence_.known_near({.centre = hint}, seen_near_mm, seen_near_mm).value_or(hint);
  }
  if (const auto known = known_in_field(order.place, 1)) return *known;
  const auto& corners = surface_.outline().corners;
  const Eigen::Vector2d middle = (corners[0] + corners[1] + corners[2] + corners[3]) / 4;
  Eigen::Vector2d p = order.place.centre.head<2>();
  if (!inside_quad(corners, p)) {
    const Eigen::Vector2d inwards = (middle - p).normalized();
    while (!inside_quad(corners, p) && (middle - p).norm() > 1) p += inwards;
    p += hint_inside_mm * inwards;
  }
  return {p.x(), p.y(), heights_.at(p.x(), p.y())};
}

void Measurement::track(const ShotOrder& order, const geometry::RigidMotion& world_from_scanner,
                        std::optional<double> plate_z_mm) {
  const auto step = tracker_.take({.world_from_scanner = world_from_scanner,
                                   .plate_found = plate_z_mm.has_value(),
                                   .plate_z_mm = plate_z_mm.value_or(0),
                                   .view = view_.boundary()});
  supervisor_.record("tracker", to_string(step.event), to_string(step.from), to_string(step.to),
                     hal::Message::format("shot {}: {}", order.number, to_string(step.action)));
  switch (step.to) {
    case TrackState::failed:
      return hold_for_plate(
          step.action == TrackAction::report_too_large ? HoldCause::plan : HoldCause::measurement, step.text);
    case TrackState::closed:
      return apply(PhaseEvent::loop_closed);
    case TrackState::seek_edge:
      break;
    default:
      apply(PhaseEvent::edge_found);
      break;
  }
  if (step.next)
    shots_.order(*step.next, step.to == TrackState::seek_edge ? ShotPurpose::seek : ShotPurpose::boundary);
}

void Measurement::order_next() {
  if (surface_next_ == surface_planned_) return;
  ShotPlace& place = surface_places_[surface_next_++];
  if (visits_of(place) == 0) place = raised_to_plate(place);
  shots_.order(place, ShotPurpose::surface);
}

void Measurement::arm_is_free() {
  if (phase_ == Phase::scan_surface) order_next();
}

bool Measurement::visit_again(const ShotPlace& place) {
  if (surface_planned_ == surface_places_.size()) return false;
  if (shots_.shots_left() <= surface_planned_ - surface_next_) return false;
  surface_places_[surface_planned_++] = place;
  return true;
}

double Measurement::part_done() const {
  if (phase_ == Phase::scan_surface && surface_planned_ > 0)
    return static_cast<double>(shots_taken(ShotPurpose::surface)) / static_cast<double>(surface_planned_);
  return phase_ == Phase::finish_fit ? surface_.progress() : 0;
}

Measurement::Left Measurement::left() {
  if (surface_planned_ > 0) time_left_.planned(surface_planned_);
  return {.time = time_left_.left(spent_), .is_planned = time_left_.is_planned()};
}

}  // namespace moldloft::tasks
