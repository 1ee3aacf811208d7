#include "tasks/cell/cell.hpp"

#include "tasks/planning/tool_pose.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <numbers>

namespace moldloft::tasks {

namespace {

// Of several commands that have come since the last tick: however often the others are sent, they never keep an abort
// or a stop waiting.
CellEvent most_urgent(unsigned commands) {
  for (const auto event : {CellEvent::abort, CellEvent::stop}) {
    if ((commands >> static_cast<int>(event) & 1u) != 0) return event;
  }
  return static_cast<CellEvent>(std::countr_zero(commands));
}

// Stopped or aborted, or on the way to it.
bool is_ending(CellState state) {
  return state == CellState::stopping || state == CellState::stopped || state == CellState::aborting ||
         state == CellState::aborted || state == CellState::clearing;
}

// A scanner that is lost comes back by itself, or does not: the line says what is waited for and how to end it.
hal::Message waiting_for_scanner(std::string_view why, Duration limit) MOLDLOFT_NONBLOCKING {
  if (limit == Duration::max())
    return hal::Message::format("{:.100}; waiting until it is back (stop ends the run)", why);
  return hal::Message::format("{:.100}; waiting {} s for it to come back (ctrl-C ends the run)", why,
                              limit / 1s);
}

// The library's starts_with() has a branch that throws.
bool begins_with(std::string_view text, std::string_view word) MOLDLOFT_NONBLOCKING {
  return text.size() >= word.size() && std::equal(word.begin(), word.end(), text.begin());
}

// Of the device that is missing: its driver says why, and may have named it already.
hal::Message why_not_ready(std::string_view device, std::string_view why) MOLDLOFT_NONBLOCKING {
  constexpr std::string_view article = "the ";
  const std::string_view named =
      begins_with(why, article) ? std::string_view{why.data() + article.size(), why.size() - article.size()}
                                : why;
  const bool names_it = begins_with(named, device);
  return names_it ? hal::Message{why} : hal::Message::format("{}: {}", device, why);
}

// A notice is read alone: who reads only that line learns which device it is about.
hal::Message named_by(HoldCause cause, const hal::Message& why) MOLDLOFT_NONBLOCKING {
  return cause == HoldCause::scanner ? why_not_ready("scanner", why) : why;
}

}  // namespace

Cell::Cell(const CellSettings& settings, Clock& clock, hal::Scanner& scanner, hal::Robot& robot,
           hal::Recorder& recorder, SurfaceTask& surface, const ShotArchive* archive)
    : settings_{settings},
      clock_{clock},
      scanner_{scanner},
      robot_{robot},
      recorder_{recorder},
      surface_{surface},
      archive_{archive},
      epoch_{settings.epoch},
      tracker_{settings.tracker},
      view_{settings.max_stripes, settings.max_points, settings.view},
      surface_places_(settings.max_surface_shots),
      time_left_{settings.tracker, settings.scan} {
  boundary_places_.reserve(static_cast<std::size_t>(settings.tracker.max_shots) + 1);
}

std::size_t Cell::plan_bytes() const {
  return view_.bytes() + tracker_.bytes() +
         (boundary_places_.capacity() + surface_places_.capacity()) * sizeof(ShotPlace);
}

void Cell::command(CellEvent event) {
  commands_.fetch_or(1 << static_cast<int>(event), std::memory_order_relaxed);
}

void Cell::run(Instant now) {
  if (state_ == CellState::execute) measuring_ += now - now_;
  now_ = now;
  account();
  if (const auto commands = static_cast<unsigned>(commands_.load(std::memory_order_relaxed)); commands != 0) {
    const CellEvent event = most_urgent(commands);
    commands_.fetch_and(~(1 << static_cast<int>(event)), std::memory_order_relaxed);
    if (event == CellEvent::hold) {
      hold(HoldCause::person, "held by command: send unhold to go on");
    } else if (event == CellEvent::abort) {
      abort("aborted by command: clear when the cell is safe");
    } else {
      apply(event);
    }
  }
  if (const auto event = robot_.next_event()) on_robot(*event);
  if (const auto event = scanner_.next_event()) on_scanner(*event);
  if (looking_ && accepted_ && !surface_.looking()) use_shot();
  advance_state();
  publish();
}

void Cell::apply(CellEvent event, const hal::Message& text) {
  const auto* row = find_transition(cell_transitions(), state_, event, CellContext{.begun = begun_});
  if (row == nullptr) return;
  record("cell", to_string(event), to_string(state_), to_string(row->to), text);
  if (event == CellEvent::hold) note(Notice::Kind::hold, named_by(cause_, text));
  if (event == CellEvent::abort) note(Notice::Kind::abort, text);
  if (event == CellEvent::unhold)
    note(Notice::Kind::goes_on, cause_ == HoldCause::person ? "unhold" : named_by(cause_, why_));
  state_ = row->to;
  entered_ = now_;
  enter(row->action);
}

void Cell::enter(CellAction action) {
  switch (action) {
    case CellAction::connect_and_calibrate:
      begun_ = true;
      cause_ = HoldCause::none;
      why_ = {};
      started_ = last_account_ = now_;
      counting_ = true;
      start_step_ = StartStep::devices;
      if (settings_.devices) start_devices();
      break;
    case CellAction::wait_for_operator:
      cause_ = HoldCause::person;
      why_ = "started held: nothing moves before an operator sends unhold";
      break;
    case CellAction::measure:
      measure();
      break;
    case CellAction::flush_records:
      counting_ = false;
      break;
    case CellAction::stop_motion:
    case CellAction::drop_everything:
      counting_ = false;
      wanted_.reset();
      if (settings_.devices) robot_.stop(now_);
      break;
    case CellAction::synchronise_again:
      cause_ = HoldCause::none;
      why_ = {};
      if (settings_.devices && robot_.state() == hal::RobotState::faulted) robot_.reset(now_);
      break;
    case CellAction::forget_run:
      wanted_.reset();
      accepted_ = false;
      drop_look();
      shot_state_ = ShotState::parked;
      set_phase(Phase::none);
      break;
    case CellAction::let_motion_end:
    case CellAction::take_up_again:
    case CellAction::none:
      break;
  }
}

void Cell::hold(HoldCause cause, const hal::Message& why) {
  // A frame that arrives while the cell holds for a device may show what needs a person: that must not get lost.
  const bool holds = state_ == CellState::holding || state_ == CellState::held;
  if (holds && cause > cause_) {
    cause_ = cause;
    why_ = why;
    record("cell", "hold", to_string(state_), to_string(state_), why);
    note(Notice::Kind::hold, named_by(cause, why));
  }
  if (state_ != CellState::execute && state_ != CellState::unholding) return;
  cause_ = cause;
  why_ = why;
  apply(CellEvent::hold, why);
}

void Cell::abort(const hal::Message& why, HoldCause cause) {
  if (state_ == CellState::aborting || state_ == CellState::aborted) return;
  why_ = why;
  cause_ = cause;
  apply(CellEvent::abort, why);
}

void Cell::on_robot(const hal::RobotEvent& event) {
  using Kind = hal::RobotEvent::Kind;
  switch (event.kind) {
    case Kind::ready:
      standing_ = event.pose;
      calibrated_ = event.calibrated;
      record("robot", "ready", "", "", event.text);
      break;
    case Kind::moving:
      break;
    case Kind::done:
      if (state_ == CellState::starting && start_step_ == StartStep::calibrating) {
        standing_ = event.pose;
        calibrated_ = true;
      } else {
        on_arrival(event.pose);
      }
      break;
    case Kind::refused:
      record("robot", "refused", "", "", event.text);
      note(Notice::Kind::warning, event.text);
      // The motion that a stop has ended answers with a refusal too, and may do so late: nothing may be sent after it.
      if (is_ending(state_)) break;
      if (state_ != CellState::execute && state_ != CellState::holding) {
        abort(event.text);
      } else if (!arm_.turned_half) {
        // The same stripes can be had with the head turned by half a turn, which puts the arm elsewhere.
        arm_.turned_half = true;
        arm_.place.head_yaw = geometry::wrapped_angle(arm_.place.head_yaw + std::numbers::pi);
        arm_.commanded = tip_pose_for(arm_.place, settings_.tip_from_scanner);
        if (const auto no =
                refuse_target(arm_.commanded, standing_, settings_.speed_percent, settings_.workspace)) {
          abort(*no, HoldCause::measurement);
        } else if (!robot_.move(arm_.commanded, settings_.speed_percent, now_)) {
          abort("robot refused a target and takes no other: check it and clear");
        }
      } else {
        abort(hal::Message::format("{} (shot {} at x {:.0f} y {:.0f} mm)", event.text.view(), arm_.number,
                                   arm_.place.centre.x(), arm_.place.centre.y()),
              HoldCause::measurement);
      }
      break;
    case Kind::fault:
    case Kind::lost:
      record("robot", event.kind == Kind::fault ? "fault" : "lost", "", "", event.text);
      abort(event.text);
      break;
  }
}

// A pose far from the target is no place to take a shot at: it would be registered there.
void Cell::on_arrival(const hal::Pose& reported) {
  standing_ = reported;
  if (const auto no = refuse_arrival(reported, arm_.commanded, settings_.arrival); no && !is_ending(state_)) {
    record("robot", "implausible", "", "", *no);
    arrival_doubted_ = true;
    return hold(HoldCause::person, *no);
  }
  apply(ShotEvent::arrived);
}

// Another scanner may have come on the same address; one that is there and does not fit needs a person.
void Cell::on_scanner(const hal::ScannerEvent& event) {
  using Kind = hal::ScannerEvent::Kind;
  switch (event.kind) {
    case Kind::ready:
      record("scanner", "ready", "", "");
      if (state_ != CellState::starting) {
        if (const auto no = refuse_scanner()) hold(HoldCause::person, *no);
      }
      break;
    case Kind::exposed:
      if (shot_state_ == ShotState::exposing && event.shot_id == arm_.shot_id) apply(ShotEvent::exposed);
      break;
    case Kind::arriving:
      if (awaits_frame() && event.shot_id == exposed_.shot_id) look_at(exposed_, scanner_.frame(), &scanner_);
      break;
    case Kind::frame:
      apply(ShotEvent::frame);
      break;
    case Kind::shot_failed:
      record("scanner", "shot failed", "", "", event.text);
      note(Notice::Kind::warning, event.text);
      drop_look();
      give_up(event.text);
      break;
    case Kind::lost:
      record("scanner", "lost", "", "", event.text);
      if (state_ != CellState::execute) note(Notice::Kind::warning, why_not_ready("scanner", event.text));
      drop_look();
      hold(HoldCause::scanner, waiting_for_scanner(event.text, settings_.scanner_wait));
      break;
    case Kind::unfit:
      record("scanner", "unfit", "", "", event.text);
      if (state_ == CellState::starting) return abort(event.text, HoldCause::measurement);
      hold(HoldCause::person, event.text);
      break;
  }
}

// What the state that the cell is in does by itself, one step a tick.
void Cell::advance_state() {
  const auto robot_rests = [this] {
    return !settings_.devices ||
           (robot_.state() != hal::RobotState::moving && robot_.state() != hal::RobotState::commanded);
  };
  switch (state_) {
    case CellState::starting:
      if (!settings_.devices) return apply(CellEvent::done);
      if (start_step_ == StartStep::devices && devices_ready()) {
        if (const auto no = refuse_scanner()) return abort(*no, HoldCause::measurement);
        start_step_ = StartStep::calibrating;
        if (!calibrated_) robot_.calibrate(now_);
      }
      if (start_step_ == StartStep::calibrating && calibrated_ && devices_ready()) {
        start_step_ = StartStep::done;
        return apply(CellEvent::done);
      }
      // The arm may calibrate as long as it likes; whoever else is not there makes the time run.
      if (devices_ready() || (scanner_ready() && robot_.state() == hal::RobotState::moving)) entered_ = now_;
      if (now_ - entered_ > settings_.device_timeout) {
        abort(scanner_ready() ? why_not_ready("robot", robot_.why())
                              : why_not_ready("scanner", scanner_.why()));
      }
      return;
    case CellState::execute:
      advance_phase();
      return sequence();
    case CellState::completing:
      return apply(CellEvent::done);
    case CellState::holding:
      if (robot_rests()) apply(CellEvent::done);
      return;
    case CellState::held:
      // Looked at, not waited for: the scanner may have come back while the arm still ended its motion.
      if (cause_ == HoldCause::scanner && scanner_ready()) return apply(CellEvent::unhold);
      if (cause_ == HoldCause::scanner && now_ - entered_ > settings_.scanner_wait) {
        hold(HoldCause::person,
             hal::Message::format("no scanner for {} s ({:.80}): bring it back, then go on",
                                  settings_.scanner_wait / 1s, scanner_.why()));
      }
      if (cause_ == HoldCause::recorder) wait_for_disk();
      return;
    case CellState::unholding:
      if (!settings_.devices || devices_ready()) apply(CellEvent::done);
      return;
    case CellState::stopping:
    case CellState::aborting:
      // A robot that no longer answers cannot say that it rests; its own watchdog stops it after three seconds.
      if (robot_rests() || robot_.state() == hal::RobotState::offline || now_ - entered_ > 5s)
        apply(CellEvent::done);
      return;
    case CellState::clearing:
      if (!settings_.devices || robot_.state() == hal::RobotState::ready) apply(CellEvent::done);
      return;
    case CellState::resetting:
      return apply(CellEvent::done);
    case CellState::idle:
    case CellState::complete:
    case CellState::stopped:
    case CellState::aborted:
      return;
  }
}

void Cell::start_devices() {
  if (devices_started_) return;
  devices_started_ = true;
  scanner_.start(now_);
  robot_.start(now_);
}

// The memory plan, the tracker's steps and the zig-zag are made for the configured field of view.
std::optional<hal::Message> Cell::refuse_scanner() const {
  constexpr double tolerance = 0.01;
  const auto& info = scanner_.info();
  const double x = 2 * settings_.tracker.field_half_x_mm, y = 2 * settings_.tracker.field_half_y_mm;
  if (info.depth_mm < (1 - tolerance) * settings_.depth_mm) {
    return hal::Message::format(
        "scanner measures {:.1f} mm to each side in height: correct [scanner] depth_mm = {:.1f}",
        info.depth_mm, settings_.depth_mm);
  }
  if (std::abs(info.field_x_mm - x) <= tolerance * x && std::abs(info.field_y_mm - y) <= tolerance * y)
    return std::nullopt;
  return hal::Message::format(
      "scanner reports a field of {:.1f} x {:.1f} mm: correct [scanner] field_mm = [{:.1f}, {:.1f}]",
      info.field_x_mm, info.field_y_mm, x, y);
}

bool Cell::scanner_ready() const {
  const auto scanner = scanner_.state();
  return scanner != hal::ScannerState::offline && scanner != hal::ScannerState::greeting;
}

bool Cell::devices_ready() const { return scanner_ready() && robot_.state() == hal::RobotState::ready; }

// The controller's own account of its cycle: what the arm does and what the scanner does, as far as it can know.
void Cell::account() {
  if (!counting_) return;
  const Duration past = now_ - last_account_;
  last_account_ = now_;
  cycle_.total += past;
  if (robot_.state() == hal::RobotState::moving) return;
  cycle_.standing += past;
  const bool scanner_works =
      scanner_.state() == hal::ScannerState::exposing || scanner_.state() == hal::ScannerState::computing;
  if (!scanner_works) cycle_.idle += past;
}

Awaited Cell::awaited() const {
  const bool scanner = settings_.devices && !scanner_ready();
  const bool robot = settings_.devices && robot_.state() != hal::RobotState::ready;
  const Awaited device = scanner && robot ? Awaited::both
                         : scanner        ? Awaited::scanner
                         : robot          ? Awaited::robot
                                          : Awaited::nothing;
  switch (state_) {
    case CellState::starting:
      return start_step_ == StartStep::calibrating && robot_.state() == hal::RobotState::moving
                 ? Awaited::calibration
                 : device;
    case CellState::holding:
    case CellState::stopping:
    case CellState::aborting:
      return Awaited::arm_at_rest;
    case CellState::held:
      return cause_ == HoldCause::scanner    ? Awaited::scanner
             : cause_ == HoldCause::recorder ? Awaited::disk
             : cause_ == HoldCause::person   ? Awaited::word_unhold
                                             : Awaited::nothing;  // it would only come to the same again
    case CellState::unholding:
      return device;
    case CellState::aborted:
      return cause_ < HoldCause::plan ? Awaited::word_clear : Awaited::nothing;
    case CellState::clearing:
      return robot ? Awaited::robot : Awaited::nothing;
    default:
      return Awaited::nothing;
  }
}

void Cell::publish() {
  CellProgress p{.state = state_, .phase = phase_, .cause = cause_, .now = now_, .why = why_};
  p.boundary_shots = taken_[static_cast<std::size_t>(hal::ShotPurpose::seek)] +
                     taken_[static_cast<std::size_t>(hal::ShotPurpose::boundary)];
  p.surface_shots = taken_[static_cast<std::size_t>(hal::ShotPurpose::surface)];
  p.surface_planned = static_cast<int>(surface_planned_);
  p.retaken = retaken_;
  if (phase_ == Phase::scan_surface && surface_planned_ > 0) {
    p.part_done = static_cast<double>(p.surface_shots) / static_cast<double>(surface_planned_);
  } else if (phase_ == Phase::finish_fit) {
    p.part_done = surface_.progress();
  }
  if (state_ == CellState::execute) {
    if (surface_planned_ > 0) time_left_.planned(surface_planned_);
    p.time_left = time_left_.left(measuring_);
    p.left_is_planned = time_left_.is_planned();
  }
  p.awaited = awaited();
  if (p.awaited == Awaited::scanner || p.awaited == Awaited::both) p.awaited_why.assign(scanner_.why());
  if (p.awaited == Awaited::robot) p.awaited_why.assign(robot_.why());
  if (p.awaited == Awaited::both) p.robot_why.assign(robot_.why());
  published_.set(p);
}

void Cell::record(std::string_view source, std::string_view event, std::string_view from, std::string_view to,
                  const hal::Message& text) {
  recorder_.event({.at = now_, .source = source, .event = event, .from = from, .to = to, .text = text});
}

}  // namespace moldloft::tasks
