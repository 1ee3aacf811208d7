#include "tasks/cell/cell.hpp"

#include "tasks/cell/device_words.hpp"

namespace moldloft::tasks {

Cell::Cell(const CellSettings& settings, hal::Scanner& scanner, hal::Robot& robot, hal::Recorder& recorder,
           SurfaceTask& surface, const ShotArchive* archive)
    : settings_{settings},
      scanner_{scanner},
      arm_{robot, settings.workspace, settings.speed_percent, settings.arrival},
      supervisor_{recorder, *this},
      disk_{settings_, supervisor_, recorder},
      start_{settings_, supervisor_, scanner, arm_},
      measurement_{settings_, supervisor_, surface, shots_},
      shots_{settings_,
             supervisor_,
             {.scanner = scanner, .arm = arm_, .recorder = recorder, .disk = disk_, .archive = archive},
             measurement_},
      report_{{.supervisor = supervisor_,
               .start = start_,
               .shots = shots_,
               .measurement = measurement_,
               .scanner = scanner,
               .arm = arm_,
               .devices = settings.devices}} {}

void Cell::run(Instant now) {
  if (supervisor_.state() == CellState::execute) measurement_.spend(now - supervisor_.now());
  supervisor_.begin_tick(now);
  cycle_.pass(now, arm_.robot().state(), scanner_.state());
  supervisor_.take_up_command();
  if (const auto event = arm_.next_event()) on_robot(*event);
  if (const auto event = scanner_.next_event()) on_scanner(*event);
  measurement_.use_view();
  advance_state();
  report_.publish();
}

void Cell::carry_out(CellAction action) {
  switch (action) {
    case CellAction::connect_and_calibrate:
      cycle_.begin(supervisor_.now());
      if (settings_.devices) arm_.clear_fault(supervisor_.now());  // held in an earlier start
      return start_.begin();
    case CellAction::measure:
      return measurement_.begin();
    case CellAction::flush_records:
      return cycle_.end();
    case CellAction::stop_motion:
    case CellAction::drop_everything:
      cycle_.end();
      shots_.drop_order();
      if (settings_.devices) arm_.stop(supervisor_.now());
      return;
    case CellAction::synchronise_again:
      if (settings_.devices) arm_.clear_fault(supervisor_.now());
      return;
    case CellAction::forget_run:
      shots_.forget();
      return measurement_.forget();
    case CellAction::wait_for_operator:
    case CellAction::let_motion_end:
    case CellAction::take_up_again:
    case CellAction::none:
      return;
  }
}

void Cell::on_robot(const hal::RobotEvent& event) {
  using Kind = hal::RobotEvent::Kind;
  switch (event.kind) {
    case Kind::ready:
      start_.robot_is_ready(event.calibrated);
      supervisor_.record("robot", "ready", "", "", event.text);
      // An arm that is not calibrated does not know where it stands; it says so once it is.
      return event.calibrated ? on_found(event.pose) : arm_.stands_at(event.pose);
    case Kind::moving:
      return;
    case Kind::done:
      return start_.takes_end_of_motion() ? on_found(event.pose) : shots_.on_arrival(event.pose);
    case Kind::stands:
      if (shots_.on_standing(event.pose)) measurement_.frame_is_lost();
      return;
    case Kind::refused:
      supervisor_.record("robot", "refused", "", "", event.text);
      supervisor_.note(Notice::Kind::warning, event.text);
      return shots_.on_refusal(event.text);
    case Kind::manual:
      supervisor_.record("robot", "manual", "", "", event.text);
      return start_.is_connecting() ? supervisor_.hold_start(event.text) : supervisor_.abort(event.text);
    case Kind::fault:
    case Kind::lost:
      supervisor_.record("robot", event.kind == Kind::fault ? "fault" : "lost", "", "", event.text);
      return supervisor_.abort(event.text);
  }
}

void Cell::on_found(const hal::Pose& reported) {
  const auto no = arm_.found(reported);
  if (!no) return;
  supervisor_.record("robot", "implausible", "", "", *no);
  if (supervisor_.state() == CellState::starting) return supervisor_.hold_start(*no);
  supervisor_.hold(HoldCause::person, *no);
}

void Cell::on_scanner(const hal::ScannerEvent& event) {
  using Kind = hal::ScannerEvent::Kind;
  const CellState state = supervisor_.state();
  switch (event.kind) {
    case Kind::ready:
      supervisor_.record("scanner", "ready", "", "");
      if (state == CellState::starting) return;
      // Another scanner may have come on the same address; one that is there and does not fit needs a person.
      if (const auto no = refuse_scanner(scanner_.info(), settings_))
        supervisor_.hold(HoldCause::person, *no);
      return;
    case Kind::exposed:
      return shots_.on_exposed(event.shot_id);
    case Kind::arriving:
      return shots_.on_arriving(event.shot_id);
    case Kind::frame:
      return shots_.on_frame();
    case Kind::shot_failed:
      supervisor_.record("scanner", "shot failed", "", "", event.text);
      supervisor_.note(Notice::Kind::warning, event.text);
      measurement_.frame_is_lost();
      return shots_.on_failure(event.text);
    case Kind::lost:
      supervisor_.record("scanner", "lost", "", "", event.text);
      if (state != CellState::execute)
        supervisor_.note(Notice::Kind::warning, why_not_ready("scanner", event.text));
      measurement_.frame_is_lost();
      return supervisor_.hold(HoldCause::scanner, waiting_for_scanner(event.text, settings_.scanner_wait));
    case Kind::unfit:
      supervisor_.record("scanner", "unfit", "", "", event.text);
      if (state == CellState::starting) return supervisor_.abort(event.text, HoldCause::measurement);
      return supervisor_.hold(HoldCause::person, event.text);
  }
}

// What the state that the cell is in does by itself, one step a tick.
void Cell::advance_state() {
  const bool arm_rests = !settings_.devices || arm_.rests();
  const hal::RobotState robot = arm_.robot().state();
  switch (supervisor_.state()) {
    case CellState::starting:
      return start_.step();
    case CellState::execute:
      measurement_.step();
      return shots_.step();
    case CellState::completing:
    case CellState::resetting:
      return supervisor_.done();
    case CellState::holding:
      if (arm_rests) supervisor_.done();
      return;
    case CellState::held:
      return look_whether_cause_has_passed();
    case CellState::unholding:
      if (!settings_.devices || start_.both_ready()) supervisor_.done();
      return;
    case CellState::stopping:
    case CellState::aborting:
      // A robot that no longer answers cannot say that it rests; its own watchdog stops it after three seconds.
      if (arm_rests || robot == hal::RobotState::offline || supervisor_.in_state() > 5s) supervisor_.done();
      return;
    case CellState::clearing:
      if (!settings_.devices || robot == hal::RobotState::ready) supervisor_.done();
      return;
    case CellState::idle:
    case CellState::complete:
    case CellState::stopped:
    case CellState::aborted:
      return;
  }
}

// Looked at, not waited for: the scanner may have come back while the arm still ended its motion.
void Cell::look_whether_cause_has_passed() {
  if (supervisor_.cause() == HoldCause::scanner) {
    if (start_.scanner_ready()) return supervisor_.take_up_again();
    if (supervisor_.in_state() > settings_.scanner_wait) {
      supervisor_.hold(HoldCause::person,
                       hal::Message::format("no scanner for {} s ({:.80}): bring it back, then go on",
                                            settings_.scanner_wait / 1s, scanner_.why()));
    }
  }
  if (supervisor_.cause() == HoldCause::recorder) disk_.step_held();
}

}  // namespace moldloft::tasks
