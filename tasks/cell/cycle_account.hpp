// The controller's own account of its cycle: what the arm does and what the scanner does, as far as it can know.
//
// Thread       the control thread
// Blocking     never
// Allocation   none
#pragma once

#include "hal/base/clock.hpp"
#include "hal/base/realtime.hpp"
#include "hal/robot/robot.hpp"
#include "hal/scanner/scanner.hpp"

namespace moldloft::tasks {

struct CycleTimes {  // over the whole run, from start to the end of Execute
  hal::Duration total{0};
  hal::Duration standing{0};  // the arm does not move
  hal::Duration idle{0};      // and the scanner neither exposes nor computes
};

class CycleAccount {
 public:
  void begin(hal::Instant now) MOLDLOFT_NONBLOCKING;
  // The time since begin() or the last pass() goes to what the devices do now; nothing before begin() or after end().
  void pass(hal::Instant now, hal::RobotState, hal::ScannerState) MOLDLOFT_NONBLOCKING;
  void end() MOLDLOFT_NONBLOCKING { counts_ = false; }

  const CycleTimes& times() const { return times_; }

 private:
  CycleTimes times_;
  hal::Instant until_{0};
  bool counts_ = false;
};

}  // namespace moldloft::tasks
