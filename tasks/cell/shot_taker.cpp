#include "tasks/cell/shot_taker.hpp"

#include "tasks/planning/tool_pose.hpp"

#include <cassert>
#include <cmath>
#include <numbers>
#include <limits>
#include <utility>

namespace moldloft::tasks {

using hal::ShotPurpose;

ShotTaker::ShotTaker(const CellSettings& settings, Supervisor& supervisor, const Devices& devices,
                     ShotUser& user)
    : settings_{settings},
      supervisor_{supervisor},
      scanner_{devices.scanner},
      arm_gate_{devices.arm},
      recorder_{devices.recorder},
      disk_{devices.disk},
      archive_{devices.archive},
      user_{user},
      epoch_{settings.epoch} {}

std::size_t ShotTaker::shots_left() const {
  if (settings_.devices) return std::numeric_limits<std::size_t>::max();
  const std::uint32_t stored = archive_ == nullptr ? 0 : archive_->last();
  return stored > last_number_ ? stored - last_number_ : 0;
}

void ShotTaker::order(const ShotPlace& place, ShotPurpose purpose) {
  ShotOrder next;
  next.number = ++last_number_;
  next.purpose = purpose;
  next.place = place;
  ordered_ = next;
}

void ShotTaker::forget() {
  ordered_.reset();
  state_ = ShotState::parked;
}

// Hands the next ordered shot to the arm, and lets the scanner expose when everything is ready for the frame.
void ShotTaker::step() {
  // Where the arm stands is in doubt, and somebody has looked: the same target once more.
  if (arrival_doubted_ && arm_gate_.robot().state() == hal::RobotState::ready) {
    arrival_doubted_ = false;
    if (!send(HoldCause::person, "robot takes no target although it said it was ready: check it and clear"))
      return;
  }
  if (ordered_ && (state_ == ShotState::parked || state_ == ShotState::computing)) {
    skip_given_up();
    if (deliver_archived()) return;
    if (!settings_.devices) {
      return supervisor_.hold(
          HoldCause::measurement,
          hal::Message::format("the recording ends before shot {}: resume the run on the cell to go on",
                               ordered_->number));
    }
    if (arm_gate_.robot().state() == hal::RobotState::ready) apply(ShotEvent::order);
  }
  if (state_ == ShotState::in_place && may_expose()) apply(ShotEvent::clear);
  if (state_ == ShotState::in_place) disk_.hold_without_room();
}

bool ShotTaker::awaits_frame() const {
  return state_ == ShotState::computing || state_ == ShotState::driving_computing ||
         state_ == ShotState::in_place_computing;
}

bool ShotTaker::may_expose() const {
  return user_.takes_frame() && scanner_.state() == hal::ScannerState::ready && recorder_.room_for_frame() &&
         !recorder_.store_failed();
}

void ShotTaker::apply(ShotEvent event) {
  const auto* row = find_transition(shot_transitions(), state_, event, ShotContext{});
  if (row == nullptr) return;
  supervisor_.record("shot", to_string(event), to_string(state_), to_string(row->to));
  state_ = row->to;
  carry_out(row->action);
}

void ShotTaker::carry_out(ShotAction action) {
  switch (action) {
    case ShotAction::drive:
      return drive();
    case ShotAction::note_pose:
      arm_.reported = arm_gate_.standing();
      return;
    case ShotAction::trigger:
      return trigger();
    case ShotAction::release_arm:
      return release_arm();
    case ShotAction::release_and_deliver:
      release_arm();
      return deliver();
    case ShotAction::deliver:
      return deliver();
    case ShotAction::drive_again:
      arrival_doubted_ = true;
      return;
    case ShotAction::drop_and_drive_again:
      arrival_doubted_ = true;
      return scanner_.forget_shot();
    case ShotAction::give_up:
    case ShotAction::none:
      return;
  }
}

void ShotTaker::drive() {
  arm_ = *ordered_;
  ordered_.reset();
  arrival_doubted_ = false;
  arm_.shot_id = (epoch_ << shot_number_bits) | arm_.number;
  if (!pick_pose(arm_)) return;
  if (!send(HoldCause::measurement,
            "robot takes no target although it said it was ready: check it and clear"))
    return;
  has_driven_ = true;
  // The places of the surface are planned: no frame decides them, and none is waited for.
  frame_decided_ = last_frame_ > hal::Instant{0} && arm_.purpose != ShotPurpose::surface;
}

// Two yaws half a turn apart look the same; the one that the workspace allows and that turns the head less is taken.
bool ShotTaker::pick_pose(ShotOrder& order) {
  std::optional<hal::Message> no;
  double least_turn = INFINITY;
  const ShotPlace wanted = order.place;
  const hal::Pose& standing = arm_gate_.standing();
  for (const double half_turn : {0.0, std::numbers::pi}) {
    ShotPlace place = wanted;
    place.head_yaw = geometry::wrapped_angle(wanted.head_yaw + half_turn);
    const hal::Pose pose = tip_pose_for(place, settings_.tip_from_scanner);
    if (auto refused = arm_gate_.refuse(pose)) {
      if (!no) no = refused;
      order.turned_half = true;  // only one of the two is left
      continue;
    }
    const double turn =
        std::abs(geometry::wrapped_angle((pose.roll - pose.yaw) - (standing.roll - standing.yaw)));
    if (turn >= least_turn) continue;
    least_turn = turn;
    order.place = place;
    order.commanded = pose;
  }
  if (std::isinf(least_turn)) supervisor_.abort(*no, HoldCause::measurement);
  return !std::isinf(least_turn);
}

// To the arm's target; what does not go out aborts the cell.
bool ShotTaker::send(HoldCause when_refused, const hal::Message& when_not_taken) {
  const ArmGate::Sending sending = arm_gate_.send_checked(arm_.commanded, supervisor_.now());
  if (sending.outcome == ArmGate::Outcome::sent) return true;
  if (sending.outcome == ArmGate::Outcome::refused) {
    supervisor_.abort(sending.why, when_refused);
  } else {
    supervisor_.abort(when_not_taken);
  }
  return false;
}

void ShotTaker::commands_sent(hal::Instant now) {
  if (!std::exchange(frame_decided_, false)) return;
  frame_to_command_.add(now - last_frame_);
  data_age_.add(now - exposed_.exposed_at);
}

// A pose far from the target is no place to take a shot at: it would be registered there.
void ShotTaker::on_arrival(const hal::Pose& reported) {
  const auto no = arm_gate_.has_arrived(reported, arm_.commanded);
  if (no && !supervisor_.is_ending()) {
    supervisor_.record("robot", "implausible", "", "", *no);
    arrival_doubted_ = true;
    return supervisor_.hold(HoldCause::person, *no);
  }
  apply(ShotEvent::arrived);
}

// An arm that has moved by itself was elsewhere at some time: a shot that was taken meanwhile, and not looked at yet,
// is not used. The same target is driven to once more. While the cell does not run, whoever holds it may move the arm.
bool ShotTaker::on_standing(const hal::Pose& reported) {
  if (supervisor_.state() != CellState::execute || arrival_doubted_) return false;
  const auto no = arm_gate_.still_stands(reported);
  if (!no) return false;
  const bool frame_is_lost = state_ == ShotState::exposing || state_ == ShotState::computing;
  supervisor_.record("robot", "implausible", "", "", *no);
  apply(ShotEvent::doubted);
  supervisor_.hold(HoldCause::person, *no);
  return frame_is_lost;
}

void ShotTaker::on_refusal(const hal::Message& text) {
  // The motion that a stop has ended answers with a refusal too, and may do so late: nothing may be sent after it.
  if (supervisor_.is_ending()) return;
  const CellState state = supervisor_.state();
  if (state != CellState::execute && state != CellState::holding) return supervisor_.abort(text);
  if (arm_.turned_half) {
    return supervisor_.abort(hal::Message::format("{} (shot {} at x {:.0f} y {:.0f} mm)", text.view(),
                                                  arm_.number, arm_.place.centre.x(), arm_.place.centre.y()),
                             HoldCause::measurement);
  }
  // The same stripes can be had with the head turned by half a turn, which puts the arm elsewhere.
  arm_.turned_half = true;
  arm_.place.head_yaw = geometry::wrapped_angle(arm_.place.head_yaw + std::numbers::pi);
  arm_.commanded = tip_pose_for(arm_.place, settings_.tip_from_scanner);
  send(HoldCause::measurement, "robot refused a target and takes no other: check it and clear");
}

void ShotTaker::on_exposed(std::uint32_t shot_id) {
  if (state_ == ShotState::exposing && shot_id == arm_.shot_id) apply(ShotEvent::exposed);
}

void ShotTaker::on_arriving(std::uint32_t shot_id) {
  if (awaits_frame() && shot_id == exposed_.shot_id) user_.frame_comes(exposed_, scanner_.frame(), &scanner_);
}

// If the arm still stands there, the shot is taken again. If it has gone on, a surface shot's place is
// visited once more at the end, a boundary shot's at once, since the tracker has no other place to go.
void ShotTaker::on_failure(const hal::Message& text) {
  const bool arm_has_gone = state_ != ShotState::exposing;
  const ShotOrder again = arm_has_gone ? exposed_ : arm_;
  apply(ShotEvent::failed);
  if (again.attempts >= settings_.max_attempts) return supervisor_.hold(HoldCause::person, text);
  if (!arm_has_gone) return;
  if (again.purpose == ShotPurpose::surface) {
    if (!user_.visit_again(again.place)) return supervisor_.hold(HoldCause::person, text);
    ++retaken_;
    if (is_done()) user_.arm_is_free();
  } else {
    // A new id: the arm may have moved, and the scanner must not answer with what it exposed elsewhere.
    ++epoch_;
    ordered_ = again;
  }
}

void ShotTaker::trigger() {
  assert(user_.takes_frame());
  if (++arm_.attempts > 1) {
    // Given up under its old id, which may be exposed already; the arm has not moved, so a new exposure is as good.
    ++retaken_;
    arm_.shot_id = (++epoch_ << shot_number_bits) | arm_.number;
  }
  scanner_.trigger(arm_.shot_id, supervisor_.now());
}

void ShotTaker::release_arm() {
  exposed_ = arm_;
  exposed_.exposed_at = supervisor_.now();
  user_.arm_is_free();
}

void ShotTaker::deliver() {
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
  user_.frame_is_whole(exposed_, frame, &scanner_, is_of_earlier_run(exposed_));
}

bool ShotTaker::is_of_earlier_run(const ShotOrder& order) const {
  return archive_ != nullptr && order.number <= archive_->last();
}

// A surface shot that is missing from the archive before later ones was given up when the run was recorded,
// and its place was put at the end of the plan (on_failure). The same happens here, or every later number
// would stand for another place.
void ShotTaker::skip_given_up() {
  while (archive_ != nullptr && ordered_ && ordered_->purpose == ShotPurpose::surface &&
         ordered_->number < archive_->last() && archive_->find(ordered_->number) == nullptr &&
         user_.visit_again(ordered_->place)) {
    ++retaken_;
    ordered_.reset();
    user_.arm_is_free();
  }
}

bool ShotTaker::deliver_archived() {
  const ArchivedShot* shot = archive_ == nullptr ? nullptr : archive_->find(ordered_->number);
  if (shot == nullptr) return false;
  if (!user_.takes_frame()) return true;  // later
  exposed_ = *ordered_;
  ordered_.reset();
  exposed_.shot_id = shot->record.shot_id;
  exposed_.commanded = shot->record.commanded;
  exposed_.reported = shot->record.reported;
  retaken_ += shot->record.attempts - 1;
  supervisor_.record("shot", "archived", "", "");
  user_.arm_is_free();
  last_frame_ = supervisor_.now();
  user_.frame_is_whole(exposed_, *shot->frame, nullptr, is_of_earlier_run(exposed_));
  return true;
}

}  // namespace moldloft::tasks
