// The supervisor: which of PackML's states the cell is in, what holds or aborts it, and what a person is told of that.
// The table is cell_state.hpp; what entering a state sets off is carried out by the owner, at once.
//
// The parts of the cell know this class and not the cell. They ask it to hold or to abort, and tell it when a
// state's work is done.
//
// Thread       the control thread; command() from anywhere; next_notice() on one other thread
// Blocking     never
// Allocation   none
// Failure      none: an event that means nothing in the present state is dropped
#pragma once

#include "hal/base/clock.hpp"
#include "hal/base/fixed_text.hpp"
#include "hal/base/realtime.hpp"
#include "hal/record/recorder.hpp"
#include "tasks/cell/notice_queue.hpp"
#include "tasks/machines/cell_state.hpp"
#include "tasks/progress/cell_progress.hpp"

#include <atomic>
#include <optional>
#include <string_view>

namespace moldloft::tasks {

// Carries out what the supervisor's table asks for.
class CellActions {
 public:
  virtual void carry_out(CellAction) MOLDLOFT_NONBLOCKING = 0;

 protected:
  ~CellActions() = default;
};

class Supervisor {
 public:
  Supervisor(hal::Recorder& recorder, CellActions& owner) : recorder_{recorder}, owner_{owner} {}

  void begin_tick(hal::Instant now) MOLDLOFT_NONBLOCKING { now_ = now; }
  hal::Instant now() const MOLDLOFT_NONBLOCKING { return now_; }  // of this tick

  void command(CellEvent);                      // an operator's or line controller's, for the next tick
  void take_up_command() MOLDLOFT_NONBLOCKING;  // one a tick, the most urgent first
  void take_up_again() MOLDLOFT_NONBLOCKING { apply(CellEvent::unhold); }  // what held the cell has passed
  void done() MOLDLOFT_NONBLOCKING { apply(CellEvent::done); }             // what the present state does
  void hold(HoldCause, const hal::Message& why) MOLDLOFT_NONBLOCKING;
  // In Starting, with nothing in motion, and for a person to mend: unhold begins the start once more.
  void hold_start(const hal::Message& why) MOLDLOFT_NONBLOCKING;
  void abort(const hal::Message& why, HoldCause = HoldCause::person) MOLDLOFT_NONBLOCKING;

  CellState state() const MOLDLOFT_NONBLOCKING { return state_; }
  hal::Duration in_state() const MOLDLOFT_NONBLOCKING { return now_ - entered_; }
  bool is_ending() const MOLDLOFT_NONBLOCKING;  // stopped or aborted, or on the way to it
  HoldCause cause() const MOLDLOFT_NONBLOCKING { return cause_; }
  const hal::Message& why() const MOLDLOFT_NONBLOCKING { return why_; }

  // Something that a person should read.
  void note(Notice::Kind kind, const hal::Message& text) MOLDLOFT_NONBLOCKING {
    notices_.push({now_, kind, text});
  }
  std::optional<Notice> next_notice() { return notices_.pop(); }
  // A line of the run's events.
  void record(std::string_view source, std::string_view event, std::string_view from, std::string_view to,
              const hal::Message& text = {}) MOLDLOFT_NONBLOCKING;

 private:
  void apply(CellEvent, const hal::Message& text = {}) MOLDLOFT_NONBLOCKING;
  void enter(CellAction) MOLDLOFT_NONBLOCKING;

  hal::Recorder& recorder_;
  CellActions& owner_;
  std::atomic<int> commands_{0};  // a bit for each CellEvent
  hal::Instant now_{0}, entered_{0};
  CellState state_ = CellState::idle;
  HoldCause cause_ = HoldCause::none;
  hal::Message why_;
  bool begun_ = false;
  NoticeQueue notices_;
};

}  // namespace moldloft::tasks
