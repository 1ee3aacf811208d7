// What people are told of a cell at work: where it is, what holds it, what it waits for, how long it still takes.
// A plain value, trivially copyable, published once a tick.
#pragma once

#include "hal/base/clock.hpp"
#include "hal/base/fixed_text.hpp"
#include "tasks/machines/cell_state.hpp"
#include "tasks/machines/phases.hpp"

#include <cstdint>

namespace moldloft::tasks {

enum class HoldCause : std::uint8_t {
  none,
  scanner,      // ends by itself when the scanner is back
  recorder,     // ends by itself when the disk takes records again
  person,       // something must be seen to; the run can be resumed then
  plan,         // the plate outgrows the memory plan: the run can be resumed with a larger one
  measurement,  // what was measured, planned or configured leads here each time: resuming would only repeat it
};

// What the cell waits for now, as far as a person may wonder.
enum class Awaited : std::uint8_t {
  nothing,
  scanner,  // to answer, or to be ready again
  robot,
  both,  // scanner and robot
  calibration,
  arm_at_rest,
  disk,         // to take records again
  word_unhold,  // from an operator
  word_clear,
};

struct CellProgress {
  CellState state = CellState::idle;
  Phase phase = Phase::none;
  HoldCause cause = HoldCause::none;
  int boundary_shots = 0, surface_shots = 0, surface_planned = 0, retaken = 0;
  double part_done = 0;  // of the phase, 0..1
  hal::Instant now{0};
  hal::Duration time_left{-1};   // negative: not known yet
  bool left_is_planned = false;  // false: an estimate of how large the plate is, too
  Awaited awaited = Awaited::nothing;
  hal::Message why{};
  hal::Message awaited_why{};  // what the device that is waited for has last come to; may be empty
  hal::Message robot_why{};    // the same of the robot where both are waited for
};

}  // namespace moldloft::tasks
