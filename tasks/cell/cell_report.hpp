// Where the cell stands, published once a tick for all who show it.
//
// Thread       publish() on the control thread; progress() from anywhere
// Blocking     never
// Allocation   none
#pragma once

#include "hal/base/latest_value.hpp"
#include "hal/base/realtime.hpp"
#include "hal/scanner/scanner.hpp"
#include "tasks/cell/arm_gate.hpp"
#include "tasks/cell/device_start.hpp"
#include "tasks/cell/measurement.hpp"
#include "tasks/cell/shot_taker.hpp"
#include "tasks/cell/supervisor.hpp"
#include "tasks/progress/cell_progress.hpp"

namespace moldloft::tasks {

struct Waiting {  // what decides for what a person may see the cell wait
  CellState state{};
  HoldCause cause{};
  bool calibrates = false, scanner_missing = false, robot_missing = false;
};
Awaited awaited(const Waiting&) MOLDLOFT_NONBLOCKING;

class CellReport {
 public:
  struct Parts {
    const Supervisor& supervisor;
    const DeviceStart& start;
    const ShotTaker& shots;
    Measurement& measurement;
    const hal::Scanner& scanner;
    const ArmGate& arm;
    bool devices;  // false: only archived shots
  };
  explicit CellReport(const Parts& parts) : parts_{parts} {}

  void publish() MOLDLOFT_NONBLOCKING;
  CellProgress progress() const { return published_.get(); }

 private:
  Parts parts_;
  hal::LatestValue<CellProgress> published_;
};

}  // namespace moldloft::tasks
