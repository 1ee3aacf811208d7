// The cell: one row of the task table. It owns the parts and passes on what happens: supervisor (PackML), start of the
// devices, one shot after another, and what is measured with them.
//
// At most one event of each device is worked on in a tick; every transition is recorded. The machines are tables.
//
// Thread       run() on the control thread; command() and progress() from anywhere
// Blocking     never
// Allocation   in the constructor only
// Failure      a fault that the cell can mend itself holds it until then. A fault that needs a person holds
//              it for a person. A dangerous one aborts it. why() says which and what to do, in one line
#pragma once

#include "hal/base/realtime.hpp"
#include "hal/record/recorder.hpp"
#include "hal/robot/robot.hpp"
#include "hal/scanner/scanner.hpp"
#include "tasks/cell/arm_gate.hpp"
#include "tasks/cell/cell_report.hpp"
#include "tasks/cell/cell_settings.hpp"
#include "tasks/cell/cycle_account.hpp"
#include "tasks/cell/device_start.hpp"
#include "tasks/cell/disk_wait.hpp"
#include "tasks/cell/measurement.hpp"
#include "tasks/cell/shot_archive.hpp"
#include "tasks/cell/shot_taker.hpp"
#include "tasks/cell/supervisor.hpp"
#include "tasks/machines/cell_state.hpp"
#include "tasks/progress/cell_port.hpp"
#include "tasks/scheduler/scheduler.hpp"
#include "tasks/slices/surface_task.hpp"

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

namespace moldloft::tasks {

class Cell final : public Task, public CellPort, private CellActions {
 public:
  Cell(const CellSettings&, hal::Scanner&, hal::Robot&, hal::Recorder&, SurfaceTask&,
       const ShotArchive* archive = nullptr);

  void run(Instant now) override;

  void command(CellEvent event) override { supervisor_.command(event); }
  // On the control thread: what is dangerous.
  void abort(const hal::Message& why, HoldCause cause = HoldCause::person) MOLDLOFT_NONBLOCKING {
    supervisor_.abort(why, cause);
  }
  bool waits_for_sending() const MOLDLOFT_NONBLOCKING { return shots_.waits_for_sending(); }
  // On the control thread, when the robot's driver has written what it had.
  void commands_sent(Instant now) MOLDLOFT_NONBLOCKING { shots_.commands_sent(now); }
  CellProgress progress() const override { return report_.progress(); }
  // On the control thread: something that a person should read.
  void note(Notice::Kind kind, const hal::Message& text) MOLDLOFT_NONBLOCKING {
    supervisor_.note(kind, text);
  }
  std::optional<Notice> next_notice() override { return supervisor_.next_notice(); }
  CellState state() const { return supervisor_.state(); }
  Phase phase() const { return measurement_.phase(); }
  HoldCause cause() const { return supervisor_.cause(); }
  const hal::Message& why() const { return supervisor_.why(); }
  bool has_driven() const { return shots_.has_driven(); }  // the arm was sent to at least one shot

  // ---- results, for reading when the cell has come to rest
  const BoundaryTracker& tracker() const { return measurement_.tracker(); }
  std::span<const ShotPlace> boundary_places() const { return measurement_.boundary_places(); }
  std::span<const ShotPlace> surface_places() const { return measurement_.surface_places(); }
  int shots_taken(hal::ShotPurpose purpose) const { return measurement_.shots_taken(purpose); }
  int shots_retaken() const { return shots_.retaken(); }
  std::uint64_t points_seen() const { return measurement_.points_seen(); }
  const CycleTimes& cycle() const { return cycle_.times(); }
  Duration surface_after_last_frame() const { return measurement_.surface_ready() - shots_.last_frame(); }
  // Of every target that a frame decided: from its last byte read to the command handed to the robot's link, ...
  const Histogram& frame_to_command() const { return shots_.frame_to_command(); }
  // ... and from the end of its exposure, as the scanner reported it: how old the data were.
  const Histogram& data_age() const { return shots_.data_age(); }
  const ClockDrift& scanner_clock() const {
    return shots_.scanner_clock();
  }  // since the scanner's last start
  const RunEvidence& evidence() const { return measurement_.evidence(); }
  std::size_t plan_bytes() const { return measurement_.plan_bytes(); }

 private:
  void carry_out(CellAction) MOLDLOFT_NONBLOCKING override;
  void on_robot(const hal::RobotEvent&) MOLDLOFT_NONBLOCKING;
  void on_found(const hal::Pose& reported) MOLDLOFT_NONBLOCKING;
  void on_scanner(const hal::ScannerEvent&) MOLDLOFT_NONBLOCKING;
  void advance_state() MOLDLOFT_NONBLOCKING;
  void look_whether_cause_has_passed() MOLDLOFT_NONBLOCKING;

  const CellSettings settings_;
  hal::Scanner& scanner_;
  ArmGate arm_;
  Supervisor supervisor_;
  DiskWait disk_;
  DeviceStart start_;
  Measurement measurement_;
  ShotTaker shots_;
  CycleAccount cycle_;
  CellReport report_;
};

}  // namespace moldloft::tasks
