// Makes scanner and robot ready for a run: connected, the configured ones, the arm calibrated. The table is
// start_sequence.hpp; this class finds the events and carries out the actions.
//
// Thread       the control thread
// Blocking     never
// Allocation   none
// Failure      a device that stays away, or a scanner that does not fit, aborts the cell with the reason
#pragma once

#include "hal/base/realtime.hpp"
#include "hal/scanner/scanner.hpp"
#include "tasks/cell/arm_gate.hpp"
#include "tasks/cell/cell_settings.hpp"
#include "tasks/cell/supervisor.hpp"
#include "tasks/machines/start_sequence.hpp"

namespace moldloft::tasks {

class DeviceStart {
 public:
  DeviceStart(const CellSettings& settings, Supervisor& supervisor, hal::Scanner& scanner, ArmGate& arm)
      : settings_{settings}, supervisor_{supervisor}, scanner_{scanner}, arm_{arm} {}

  void begin() MOLDLOFT_NONBLOCKING;  // Starting is entered
  void step() MOLDLOFT_NONBLOCKING;   // once a tick in Starting; says done when all is ready

  // The robot has synchronised and says whether it knows where it stands, ...
  void robot_is_ready(bool calibrated) MOLDLOFT_NONBLOCKING { calibrated_ = calibrated; }
  // ... or its motion has ended: true when that was the calibration.
  bool takes_end_of_motion() MOLDLOFT_NONBLOCKING;

  bool scanner_ready() const MOLDLOFT_NONBLOCKING;
  bool both_ready() const MOLDLOFT_NONBLOCKING;
  bool is_connecting() const MOLDLOFT_NONBLOCKING;  // nothing was commanded yet
  bool calibrates() const MOLDLOFT_NONBLOCKING;  // the arm moves for it now

 private:
  void apply(StartEvent, const StartContext&) MOLDLOFT_NONBLOCKING;
  void carry_out(StartAction) MOLDLOFT_NONBLOCKING;

  const CellSettings& settings_;
  Supervisor& supervisor_;
  hal::Scanner& scanner_;
  ArmGate& arm_;
  StartState state_ = StartState::off;
  hal::Instant missing_since_{0};
  bool connected_ = false, calibrated_ = false;
};

}  // namespace moldloft::tasks
