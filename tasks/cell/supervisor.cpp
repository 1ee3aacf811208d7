#include "tasks/cell/supervisor.hpp"

#include "tasks/cell/device_words.hpp"

#include <bit>

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

// A notice is read alone, so the line itself says which device it is about.
hal::Message named_by(HoldCause cause, const hal::Message& why) MOLDLOFT_NONBLOCKING {
  return cause == HoldCause::scanner ? why_not_ready("scanner", why) : why;
}

}  // namespace

void Supervisor::command(CellEvent event) {
  commands_.fetch_or(1 << static_cast<int>(event), std::memory_order_relaxed);
}

void Supervisor::take_up_command() {
  const auto commands = static_cast<unsigned>(commands_.load(std::memory_order_relaxed));
  if (commands == 0) return;
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

void Supervisor::apply(CellEvent event, const hal::Message& text) {
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
  owner_.carry_out(row->action);
}

void Supervisor::enter(CellAction action) {
  if (action == CellAction::connect_and_calibrate) begun_ = true;
  if (action == CellAction::connect_and_calibrate || action == CellAction::synchronise_again) {
    cause_ = HoldCause::none;
    why_ = {};
  } else if (action == CellAction::wait_for_operator) {
    cause_ = HoldCause::person;
    why_ = "started held: nothing moves before an operator sends unhold";
  }
}

void Supervisor::hold(HoldCause cause, const hal::Message& why) {
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

void Supervisor::hold_start(const hal::Message& why) {
  if (state_ != CellState::starting) return;
  begun_ = false;
  cause_ = HoldCause::person;
  why_ = why;
  apply(CellEvent::hold, why);
}

void Supervisor::abort(const hal::Message& why, HoldCause cause) {
  if (state_ == CellState::aborting || state_ == CellState::aborted) return;
  why_ = why;
  cause_ = cause;
  apply(CellEvent::abort, why);
}

bool Supervisor::is_ending() const {
  return state_ == CellState::stopping || state_ == CellState::stopped || state_ == CellState::aborting ||
         state_ == CellState::aborted || state_ == CellState::clearing;
}

void Supervisor::record(std::string_view source, std::string_view event, std::string_view from,
                        std::string_view to, const hal::Message& text) {
  recorder_.event({.at = now_, .source = source, .event = event, .from = from, .to = to, .text = text});
}

}  // namespace moldloft::tasks
