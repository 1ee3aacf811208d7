// One shot after another: drive, expose, deliver; and the same from the archive.
#include "tasks/cell/cell.hpp"
#include "tasks/planning/tool_pose.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

namespace moldloft::tasks {

using hal::ShotPurpose;

namespace {

// A disk that writes back what it has taken may stand for seconds; the arm stands meanwhile, and nothing is said.
constexpr Duration longest_without_room = 5s;

// A path goes first where a message has no place for all of it: what is wrong stands at the end.
hal::Message end_of(std::string_view text) MOLDLOFT_NONBLOCKING {
  constexpr std::size_t kept = 100;
  if (text.size() <= kept) return text;
  text.remove_prefix(text.size() - kept);
  while (!text.empty() && (static_cast<unsigned char>(text.front()) & 0xC0u) == 0x80u) text.remove_prefix(1);
  return hal::Message::format("...{}", text);
}

hal::Message waiting_for_room(std::string_view why, Duration limit) MOLDLOFT_NONBLOCKING {
  if (limit == Duration::max())
    return hal::Message::format("{}; waiting until there is room (stop ends the run)", end_of(why).view());
  return hal::Message::format("{}; waiting {} s for room (ctrl-C ends the run)", end_of(why).view(),
                              limit / 1s);
}

}  // namespace

void Cell::want(const ShotPlace& place, ShotPurpose purpose) {
  Order order;
  order.number = ++last_number_;
  order.purpose = purpose;
  order.place = place;
  wanted_ = order;
}

// Hands the next wanted shot to the arm, and lets the scanner expose when everything is ready for the frame.
void Cell::sequence() {
  // Where the arm stands is in doubt, and somebody has looked: the same target once more.
  if (arrival_doubted_ && robot_.state() == hal::RobotState::ready) {
    arrival_doubted_ = false;
    if (const auto no =
            refuse_target(arm_.commanded, standing_, settings_.speed_percent, settings_.workspace))
      return abort(*no);
    if (!robot_.move(arm_.commanded, settings_.speed_percent, now_))
      return abort("robot takes no target although it said it was ready: check it and clear");
  }
  if (wanted_ && (shot_state_ == ShotState::parked || shot_state_ == ShotState::computing)) {
    skip_given_up();
    if (deliver_archived()) return;
    if (!settings_.devices) {
      return hold(
          HoldCause::measurement,
          hal::Message::format("the recording ends before shot {}: resume the run on the cell to go on",
                               wanted_->number));
    }
    if (robot_.state() == hal::RobotState::ready) apply(ShotEvent::order);
  }
  if (shot_state_ == ShotState::in_place && may_expose()) apply(ShotEvent::clear);
  if (shot_state_ == ShotState::in_place) hold_without_room();
}

// A shot is waited with while the records of those before are still on their way to the disk: for moments where it is
// slow, for good where it hangs.
void Cell::hold_without_room() {
  if (recorder_.room_for_frame()) {
    no_room_since_ = Instant::max();
    return;
  }
  no_room_since_ = std::min(no_room_since_, now_);
  if (recorder_.store_failed()) {
    hold(HoldCause::recorder, waiting_for_room(recorder_.store_error().view(), settings_.disk_wait));
  } else if (now_ - no_room_since_ > longest_without_room) {
    hold(HoldCause::recorder,
         waiting_for_room("the disk does not take what is measured: too slow, or it hangs",
                          settings_.disk_wait));
  }
}

// Held: goes on when there is room. Where nobody could say so, not for ever.
void Cell::wait_for_disk() {
  if (recorder_.room_for_frame()) return apply(CellEvent::unhold);
  if (now_ - entered_ <= settings_.disk_wait) return;
  const hal::Message error =
      recorder_.store_failed() ? recorder_.store_error() : hal::Message{"the disk hangs"};
  hold(HoldCause::person, hal::Message::format("nothing could be stored for {} s: {}",
                                               settings_.disk_wait / 1s, end_of(error).view()));
}

bool Cell::awaits_frame() const {
  return shot_state_ == ShotState::computing || shot_state_ == ShotState::driving_computing ||
         shot_state_ == ShotState::in_place_computing;
}

// The next frame would overwrite the last one: nobody may need that any more.
bool Cell::frame_is_done() const {
  const auto stage = surface_.stage();
  return !looking_ && !surface_.keeping() && stage != SurfaceTask::Stage::folding &&
         stage != SurfaceTask::Stage::folding_reserve;
}

bool Cell::may_expose() const {
  return frame_is_done() && scanner_.state() == hal::ScannerState::ready && recorder_.room_for_frame() &&
         !recorder_.store_failed();
}

void Cell::apply(ShotEvent event) {
  const auto* row = find_transition(shot_transitions(), shot_state_, event, ShotContext{});
  if (row == nullptr) return;
  record("shot", to_string(event), to_string(shot_state_), to_string(row->to));
  shot_state_ = row->to;
  carry_out(row->action);
}

void Cell::carry_out(ShotAction action) {
  switch (action) {
    case ShotAction::drive:
      return drive();
    case ShotAction::note_pose:
      arm_.reported = standing_;
      return;
    case ShotAction::trigger:
      return trigger();
    case ShotAction::release_arm:
      exposed_ = arm_;
      exposed_.exposed_at = now_;
      if (phase_ == Phase::scan_surface) next_surface_shot();
      return;
    case ShotAction::release_and_deliver:
      exposed_ = arm_;
      exposed_.exposed_at = now_;
      if (phase_ == Phase::scan_surface) next_surface_shot();
      return deliver();
    case ShotAction::deliver:
      return deliver();
    case ShotAction::give_up:
    case ShotAction::none:
      return;
  }
}

void Cell::drive() {
  arm_ = *wanted_;
  wanted_.reset();
  arrival_doubted_ = false;
  arm_.shot_id = (epoch_ << shot_number_bits) | arm_.number;
  if (!pick_pose(arm_)) return;
  if (!robot_.move(arm_.commanded, settings_.speed_percent, now_)) {
    return abort("robot takes no target although it said it was ready: check it and clear");
  }
  has_driven_ = true;
  // The places of the surface are planned: no frame decides them, and none is waited for.
  frame_decided_ = last_frame_ > Instant{0} && arm_.purpose != ShotPurpose::surface;
}

void Cell::commands_sent(Instant now) {
  if (!std::exchange(frame_decided_, false)) return;
  frame_to_command_.add(now - last_frame_);
  data_age_.add(now - exposed_.exposed_at);
}

// Two yaws half a turn apart look the same; the one that the workspace allows and that turns the head less is taken.
bool Cell::pick_pose(Order& order) {
  std::optional<hal::Message> no;
  double least_turn = INFINITY;
  const ShotPlace wanted = order.place;
  for (const double half_turn : {0.0, std::numbers::pi}) {
    ShotPlace place = wanted;
    place.head_yaw = geometry::wrapped_angle(wanted.head_yaw + half_turn);
    const hal::Pose pose = tip_pose_for(place, settings_.tip_from_scanner);
    if (auto refused = refuse_target(pose, standing_, settings_.speed_percent, settings_.workspace)) {
      if (!no) no = refused;
      order.turned_half = true;  // only one of the two is left
      continue;
    }
    const double turn =
        std::abs(geometry::wrapped_angle((pose.roll - pose.yaw) - (standing_.roll - standing_.yaw)));
    if (turn >= least_turn) continue;
    least_turn = turn;
    order.place = place;
    order.commanded = pose;
  }
  if (std::isinf(least_turn)) abort(*no, HoldCause::measurement);
  return !std::isinf(least_turn);
}

void Cell::trigger() {
  if (++arm_.attempts > 1) {
    // Given up under its old id, which may be exposed already; the arm has not moved, so a new exposure is as good.
    ++retaken_;
    arm_.shot_id = (++epoch_ << shot_number_bits) | arm_.number;
  }
  scanner_.trigger(arm_.shot_id, now_);
}

// The driver has given a shot up. Where the arm still stands it is taken again; where it has gone on, the place is
// visited once more at the end (surface) or at once (boundary: nothing else is known to do).
void Cell::give_up(const hal::Message& text) {
  Order& order = shot_state_ == ShotState::exposing ? arm_ : exposed_;
  if (order.attempts >= settings_.max_attempts) {
    apply(ShotEvent::failed);
    return hold(HoldCause::person, text);
  }
  const bool arm_has_gone = shot_state_ != ShotState::exposing;
  const Order again = order;
  apply(ShotEvent::failed);
  if (!arm_has_gone) return;
  if (again.purpose == ShotPurpose::surface) {
    if (surface_planned_ == surface_places_.size()) return hold(HoldCause::person, text);
    surface_places_[surface_planned_++] = again.place;
    ++retaken_;
    if (!wanted_ && shot_state_ == ShotState::parked) next_surface_shot();
  } else {
    // A new id: the arm may have moved, and the scanner must not answer with what it exposed elsewhere.
    ++epoch_;
    wanted_ = again;
  }
}

void Cell::deliver() {
  const auto& frame = scanner_.frame();
  last_frame_ = frame.arrived;
  if (std::exchange(scanner_session_, frame.session_id) != frame.session_id) scanner_clock_.reset();
  scanner_clock_.add(exposed_.exposed_at, frame.exposed_sensor_ns);
  recorder_.shot({.at = frame.arrived,
                  .shot_id = exposed_.shot_id,
                  .purpose = exposed_.purpose,
                  .attempts = static_cast<std::uint16_t>(exposed_.attempts),
                  .commanded = exposed_.commanded,
                  .reported = exposed_.reported,
                  .payload_offset = scanner_.frame_offset(),
                  .payload_bytes = scanner_.frame_bytes()});
  if (!looking_) look_at(exposed_, frame, &scanner_);
  accept(frame);
}

// A surface shot that the archive leaves out before later ones was given up when the run was recorded, and
// its place was put at the end of the plan (give_up): so it is again, or every later number would stand
// for another place.
void Cell::skip_given_up() {
  while (archive_ != nullptr && wanted_ && wanted_->purpose == ShotPurpose::surface &&
         wanted_->number < archive_->last() && archive_->find(wanted_->number) == nullptr &&
         surface_planned_ < surface_places_.size()) {
    surface_places_[surface_planned_++] = wanted_->place;
    ++retaken_;
    wanted_.reset();
    next_surface_shot();
  }
}

bool Cell::deliver_archived() {
  const ArchivedShot* shot = archive_ == nullptr ? nullptr : archive_->find(wanted_->number);
  if (shot == nullptr) return false;
  if (!frame_is_done()) return true;  // later
  exposed_ = *wanted_;
  wanted_.reset();
  exposed_.shot_id = shot->record.shot_id;
  exposed_.commanded = shot->record.commanded;
  exposed_.reported = shot->record.reported;
  retaken_ += shot->record.attempts - 1;
  record("shot", "archived", "", "");
  if (phase_ == Phase::scan_surface) next_surface_shot();
  last_frame_ = now_;
  look_at(exposed_, *shot->frame, nullptr);
  accept(*shot->frame);
  return true;
}

}  // namespace moldloft::tasks
