// The controller put together: drivers on their links, the cell, the background fit, the task table. The same
// object runs on real devices and in simulation; only clock and links differ.
//
// Thread       constructed anywhere; start() and tick() on the control thread; cell().command()
//              and progress() anywhere; recorder().drain() on one other thread (or between ticks,
//              in virtual time)
// Blocking     tick() sleeps until the next tick and not otherwise
// Allocation   in the constructor and in start() (links are opened); none in tick()
// Failure      the constructor throws nothing; what goes wrong shows in the cell's state and why()
#pragma once

#include "firmware_like/config/config.hpp"
#include "firmware_like/config/memory_plan.hpp"
#include "firmware_like/process/stop_signals.hpp"
#include "hal/base/realtime.hpp"
#include "hal/record/flight_recorder.hpp"
#include "hal/record/recorder.hpp"
#include "hal/record/tapped_link.hpp"
#include "hal/robot/line_robot.hpp"
#include "hal/scanner/psc_scanner.hpp"
#include "tasks/cell/cell.hpp"
#include "tasks/scheduler/scheduler.hpp"

#include <atomic>
#include <memory>

namespace moldloft::firmware_like {

struct ControllerOptions {
  const tasks::ShotArchive* archive = nullptr;  // shots of a run that is resumed or fitted again
  std::uint32_t epoch = 1;                      // of this run's shot ids
  std::uint32_t nonce = 1;  // before the first SYN's: another at each start of the program
  bool devices = true;      // false: archived shots only
  bool begin_held = false;  // nothing moves before an operator sends unhold
  // Somebody can command the cell: what waits for a person is waited for, instead of ending the run.
  bool attended = false;
};

class Controller final : public Stoppable {
 public:
  Controller(const CellConfig&, hal::Clock&, hal::ByteLink& scanner_link, hal::ByteLink& robot_link,
             const ControllerOptions& = {});

  void start();  // commands the cell to start, or to start held; the first tick is due now
  bool tick();   // one tick; false when the cell has come to rest
  bool at_rest() const;
  // From anywhere: nobody will come to clear what has aborted. (A cell that is held can be commanded to stop.)
  void dismiss_operator() noexcept { dismissed_ = true; }
  // A cell that waits for an operator, aborted or held, does so no longer.
  void stop_for_good() noexcept override;

  const CellConfig& config() const { return config_; }
  tasks::Cell& cell() { return cell_; }
  const tasks::Cell& cell() const { return cell_; }
  const tasks::SurfaceTask& surface() const { return surface_; }
  const tasks::Scheduler& scheduler() const { return scheduler_; }
  hal::Recorder& recorder() { return recorder_; }
  const hal::Recorder& recorder() const { return recorder_; }
  hal::FlightRecorder& flight() { return flight_; }
  const hal::FlightRecorder& flight() const { return flight_; }
  const hal::Scanner& scanner() const { return *scanner_; }
  const hal::Robot& robot() const { return *robot_; }
  MemoryPlan memory() const;

 private:
  struct Row {  // of the task table: a function of the controller
    Controller* owner;
    void (Controller::*function)(hal::Instant) MOLDLOFT_NONBLOCKING;
    void operator()(hal::Instant now) const { (owner->*function)(now); }
  };
  using RowTask = tasks::FunctionTask<Row>;
  void receive_scanner(hal::Instant now) MOLDLOFT_NONBLOCKING { scanner_->receive(now); }
  void receive_robot(hal::Instant now) MOLDLOFT_NONBLOCKING { robot_->receive(now); }
  void transmit_robot(hal::Instant now) MOLDLOFT_NONBLOCKING;
  void transmit_scanner(hal::Instant now) MOLDLOFT_NONBLOCKING { scanner_->transmit(now); }
  void watch_health(hal::Instant now) MOLDLOFT_NONBLOCKING;
  hal::Message missed_tick_text() const MOLDLOFT_NONBLOCKING;
  void report_abort() MOLDLOFT_NONBLOCKING;

  CellConfig config_;
  hal::Clock& clock_;
  const bool begin_held_, attended_;
  std::atomic<bool> dismissed_{false};
  hal::FlightRecorder flight_;
  hal::Recorder recorder_;
  hal::TappedLink scanner_link_, robot_link_;
  std::unique_ptr<hal::Scanner> scanner_;
  std::unique_ptr<hal::Robot> robot_;
  tasks::SurfaceTask surface_;
  tasks::Cell cell_;
  RowTask receive_scanner_, receive_robot_, transmit_robot_, transmit_scanner_, health_;
  tasks::Scheduler scheduler_;
  bool abort_reported_ = false;
};

}  // namespace moldloft::firmware_like
