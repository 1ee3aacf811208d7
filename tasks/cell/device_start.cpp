#include "tasks/cell/device_start.hpp"

#include "tasks/cell/device_words.hpp"

#include <utility>

namespace moldloft::tasks {

void DeviceStart::begin() {
  missing_since_ = supervisor_.now();
  if (settings_.devices) apply(StartEvent::begin, {});
}

void DeviceStart::step() {
  if (!settings_.devices) return supervisor_.done();
  const hal::Instant now = supervisor_.now();
  if (both_ready()) {
    missing_since_ = now;
    return apply(StartEvent::both_ready, {.misfit = refuse_scanner(scanner_.info(), settings_).has_value(),
                                          .calibrated = calibrated_});
  }
  // The arm may calibrate as long as it likes. The time-out runs while any other device is missing.
  if (scanner_ready() && arm_.robot().state() == hal::RobotState::moving) {
    missing_since_ = now;
  } else {
    apply(StartEvent::missing, {.timed_out = now - missing_since_ > settings_.device_timeout});
  }
}

void DeviceStart::apply(StartEvent event, const StartContext& context) {
  const auto* row = find_transition(start_transitions(), state_, event, context);
  if (row == nullptr) return;
  state_ = row->to;
  carry_out(row->action);
}

void DeviceStart::carry_out(StartAction action) {
  const hal::Instant now = supervisor_.now();
  switch (action) {
    case StartAction::connect:
      if (std::exchange(connected_, true)) return;  // the drivers keep their links alive by themselves
      scanner_.start(now);
      return arm_.start(now);
    case StartAction::calibrate:
      return arm_.calibrate(now);
    case StartAction::go_on:
      return supervisor_.done();
    case StartAction::refuse_scanner:
      return supervisor_.abort(*refuse_scanner(scanner_.info(), settings_), HoldCause::measurement);
    case StartAction::give_up:
      return supervisor_.abort(scanner_ready() ? why_not_ready("robot", arm_.robot().why())
                                               : why_not_ready("scanner", scanner_.why()));
    case StartAction::none:
      return;
  }
}

bool DeviceStart::takes_end_of_motion() {
  if (supervisor_.state() != CellState::starting || state_ != StartState::calibrating) return false;
  calibrated_ = true;
  return true;
}

bool DeviceStart::scanner_ready() const {
  const auto scanner = scanner_.state();
  return scanner != hal::ScannerState::offline && scanner != hal::ScannerState::greeting;
}

bool DeviceStart::both_ready() const {
  return scanner_ready() && arm_.robot().state() == hal::RobotState::ready;
}

bool DeviceStart::is_connecting() const {
  return supervisor_.state() == CellState::starting && state_ == StartState::connecting;
}

bool DeviceStart::calibrates() const {
  return state_ == StartState::calibrating && arm_.robot().state() == hal::RobotState::moving;
}

}  // namespace moldloft::tasks
