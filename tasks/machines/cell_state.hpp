// The cell's supervisor: the states of ISA-TR88 (PackML), since that is what line controllers speak,
// as one table.
#pragma once

#include "hal/base/realtime.hpp"
#include "hal/base/transition.hpp"

#include <cstdint>
#include <span>
#include <string_view>

namespace moldloft::tasks {

enum class CellState : std::uint8_t {
  idle,
  starting,
  execute,
  completing,
  complete,
  holding,
  held,
  unholding,
  stopping,
  stopped,
  aborting,
  aborted,
  clearing,
  resetting,
};
constexpr int cell_state_count = 14;

enum class CellEvent : std::uint8_t {
  start,
  start_held,  // after a restart: nothing may move before an operator says so
  hold,
  unhold,
  stop,
  abort,
  clear,
  reset,  // commands, and hold/abort by the cell itself
  done,   // what the present state does is finished (PackML: SC)
};
constexpr int cell_event_count = 9;

// What the cell begins to do on entering the next state.
enum class CellAction : std::uint8_t {
  none,
  connect_and_calibrate,
  wait_for_operator,
  measure,
  flush_records,
  let_motion_end,
  take_up_again,
  stop_motion,
  drop_everything,
  synchronise_again,
  forget_run,
};

struct CellContext {
  bool begun = false;  // Starting was entered and not held: devices are connected, the arm is calibrated
};

using CellTransition = hal::Transition<CellState, CellEvent, CellAction, CellContext>;
std::span<const CellTransition> cell_transitions() MOLDLOFT_NONBLOCKING;
std::span<const hal::Ignored<CellState, CellEvent>> cell_ignored();

std::string_view to_string(CellState) MOLDLOFT_NONBLOCKING;
std::string_view to_string(CellEvent) MOLDLOFT_NONBLOCKING;
std::string_view to_string(CellAction);

}  // namespace moldloft::tasks
