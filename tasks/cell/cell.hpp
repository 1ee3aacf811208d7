// The cell: supervisor (PackML), what happens inside Execute, and one shot after another. One row of
// the task table.
//
// At most one event of each source is worked on in a tick; every transition is recorded. The machines themselves are
// tables (cell_state.hpp, shot_sequence.hpp, boundary_tracker.hpp); this class carries their actions out.
//
// Thread       run() on the control thread; command() and progress() from anywhere
// Blocking     never
// Allocation   in the constructor only
// Failure      what the cell can mend itself holds it until it is mended; what needs a person holds it for a person;
//              what is dangerous aborts it. why() says which and what to do, in one line
#pragma once

#include "hal/base/latest_value.hpp"
#include "hal/base/realtime.hpp"
#include "hal/record/recorder.hpp"
#include "hal/robot/robot.hpp"
#include "hal/scanner/scanner.hpp"
#include "tasks/cell/cell_progress.hpp"
#include "tasks/cell/motion_guard.hpp"
#include "tasks/cell/notice.hpp"
#include "tasks/cell/shot_archive.hpp"
#include "tasks/cell/time_left.hpp"
#include "tasks/machines/boundary_tracker.hpp"
#include "tasks/machines/cell_state.hpp"
#include "tasks/machines/shot_sequence.hpp"
#include "tasks/planning/scan_plan.hpp"
#include "tasks/scheduler/clock_drift.hpp"
#include "tasks/scheduler/scheduler.hpp"
#include "tasks/slices/surface_task.hpp"

#include <atomic>
#include <optional>
#include <span>
#include <vector>

namespace moldloft::tasks {

struct CellSettings {
  geometry::RigidMotion tip_from_scanner = geometry::RigidMotion::Identity();
  ShotPlace start;
  int speed_percent = 100;
  Workspace workspace;
  TrackerSettings tracker;
  ScanPlanSettings scan;
  ShotViewSettings view;
  std::size_t max_stripes = 128, max_points = 65536;  // of a frame
  std::size_t max_surface_shots = 64;
  double depth_mm = 60;             // the scanner's, to each side: how far off in height the start may be
  double lowest_plate_z_mm = -1e9;  // what lies lower is the table
  int max_attempts = 3;             // of one shot, before the cell holds
  Duration device_timeout = 10s;    // for scanner and robot to become ready at the start
  Duration scanner_wait = Duration::max();  // for one that is lost; then a person is waited for
  Duration disk_wait = Duration::max();     // likewise for one that is full or hangs
  Arrival arrival;
  std::uint32_t epoch = 1;  // of this run's shot ids (shot_archive.hpp)
  bool devices = true;      // false: only archived shots, nothing moves
};

struct CycleTimes {  // over the whole run, from start to the end of Execute
  Duration total{0}, standing{0}, idle{0};
};

class Cell final : public Task {
 public:
  Cell(const CellSettings&, Clock&, hal::Scanner&, hal::Robot&, hal::Recorder&, SurfaceTask&,
       const ShotArchive* archive = nullptr);

  void run(Instant now) override;

  void command(CellEvent);  // an operator's or line controller's command, taken up in the next tick
  void abort(const hal::Message& why,
             HoldCause = HoldCause::person) MOLDLOFT_NONBLOCKING;  // on the control thread: what is dangerous
  bool waits_for_sending() const MOLDLOFT_NONBLOCKING { return frame_decided_; }
  // On the control thread, when the robot's driver has written what it had.
  void commands_sent(Instant now) MOLDLOFT_NONBLOCKING;
  CellProgress progress() const { return published_.get(); }
  // On the control thread: something that a person should read.
  void note(Notice::Kind kind, const hal::Message& text) MOLDLOFT_NONBLOCKING {
    notices_.push({now_, kind, text});
  }
  // On one other thread: what has been noted since, in order.
  std::optional<Notice> next_notice() { return notices_.pop(); }
  CellState state() const { return state_; }
  Phase phase() const { return phase_; }
  HoldCause cause() const { return cause_; }
  const hal::Message& why() const { return why_; }
  bool has_driven() const { return has_driven_; }  // the arm was sent to at least one shot

  // ---- results, for reading when the cell has come to rest
  const BoundaryTracker& tracker() const { return tracker_; }
  std::span<const ShotPlace> boundary_places() const { return boundary_places_; }
  std::span<const ShotPlace> surface_places() const { return {surface_places_.data(), surface_planned_}; }
  int shots_taken(hal::ShotPurpose purpose) const { return taken_[static_cast<std::size_t>(purpose)]; }
  int shots_retaken() const { return retaken_; }
  std::uint64_t points_seen() const { return points_seen_; }
  const CycleTimes& cycle() const { return cycle_; }
  Duration surface_after_last_frame() const { return surface_ready_ - last_frame_; }
  // Of every target that a frame decided: from its last byte read to the command handed to the robot's link, ...
  const Histogram& frame_to_command() const { return frame_to_command_; }
  // ... and from the end of its exposure, as the scanner reported it: how old the data were.
  const Histogram& data_age() const { return data_age_; }
  const ClockDrift& scanner_clock() const { return scanner_clock_; }  // since the scanner's last start
  std::size_t view_bytes() const { return view_.bytes(); }
  std::size_t plan_bytes() const;

 private:
  struct Order {
    std::uint32_t number = 0, shot_id = 0;
    hal::ShotPurpose purpose{};
    ShotPlace place;
    hal::Pose commanded, reported;
    Instant exposed_at{0};
    int attempts = 0;
    bool turned_half = false;  // the other of the two yaws that look the same has been tried
  };
  enum class StartStep : std::uint8_t { devices, calibrating, done };

  // cell.cpp: the supervisor
  void apply(CellEvent, const hal::Message& text = {}) MOLDLOFT_NONBLOCKING;
  void enter(CellAction) MOLDLOFT_NONBLOCKING;
  void hold(HoldCause, const hal::Message&) MOLDLOFT_NONBLOCKING;
  void on_robot(const hal::RobotEvent&) MOLDLOFT_NONBLOCKING;
  void on_scanner(const hal::ScannerEvent&) MOLDLOFT_NONBLOCKING;
  void advance_state() MOLDLOFT_NONBLOCKING;
  void start_devices() MOLDLOFT_NONBLOCKING;
  std::optional<hal::Message> refuse_scanner() const MOLDLOFT_NONBLOCKING;
  void on_arrival(const hal::Pose& reported) MOLDLOFT_NONBLOCKING;
  bool scanner_ready() const MOLDLOFT_NONBLOCKING;
  bool devices_ready() const MOLDLOFT_NONBLOCKING;
  void account() MOLDLOFT_NONBLOCKING;
  Awaited awaited() const MOLDLOFT_NONBLOCKING;
  void publish() MOLDLOFT_NONBLOCKING;
  void record(std::string_view source, std::string_view event, std::string_view from, std::string_view to,
              const hal::Message& text = {}) MOLDLOFT_NONBLOCKING;

  // cell_shots.cpp: one shot after another
  void want(const ShotPlace&, hal::ShotPurpose) MOLDLOFT_NONBLOCKING;
  void sequence() MOLDLOFT_NONBLOCKING;
  void hold_without_room() MOLDLOFT_NONBLOCKING;
  void wait_for_disk() MOLDLOFT_NONBLOCKING;
  void apply(ShotEvent) MOLDLOFT_NONBLOCKING;
  void carry_out(ShotAction) MOLDLOFT_NONBLOCKING;
  void drive() MOLDLOFT_NONBLOCKING;
  bool pick_pose(Order&) MOLDLOFT_NONBLOCKING;
  void trigger() MOLDLOFT_NONBLOCKING;
  void deliver() MOLDLOFT_NONBLOCKING;
  void give_up(const hal::Message&) MOLDLOFT_NONBLOCKING;
  bool deliver_archived() MOLDLOFT_NONBLOCKING;
  void skip_given_up() MOLDLOFT_NONBLOCKING;
  bool awaits_frame() const MOLDLOFT_NONBLOCKING;
  bool frame_is_done() const MOLDLOFT_NONBLOCKING;
  bool may_expose() const MOLDLOFT_NONBLOCKING;
  Eigen::Vector3d hint_in_world(const Order&) const MOLDLOFT_NONBLOCKING;

  // cell_phases.cpp: what happens inside Execute
  void set_phase(Phase) MOLDLOFT_NONBLOCKING;
  void measure() MOLDLOFT_NONBLOCKING;
  void advance_phase() MOLDLOFT_NONBLOCKING;
  void look_at(const Order&, const hal::Frame&, hal::Scanner* unpacks) MOLDLOFT_NONBLOCKING;
  void drop_look() MOLDLOFT_NONBLOCKING;
  void accept(const hal::Frame&) MOLDLOFT_NONBLOCKING;
  void use_shot() MOLDLOFT_NONBLOCKING;
  std::optional<double> learn_heights(const geometry::RigidMotion& world_from_scanner) MOLDLOFT_NONBLOCKING;
  void use_boundary_shot(const Order&, const geometry::RigidMotion& world_from_scanner,
                         std::optional<double> plate_z_mm) MOLDLOFT_NONBLOCKING;
  void plan_surface() MOLDLOFT_NONBLOCKING;
  void next_surface_shot() MOLDLOFT_NONBLOCKING;

  CellSettings settings_;
  Clock& clock_;
  hal::Scanner& scanner_;
  hal::Robot& robot_;
  hal::Recorder& recorder_;
  SurfaceTask& surface_;
  const ShotArchive* archive_;

  Instant now_{0}, entered_{0}, started_{0}, last_account_{0}, last_frame_{0}, surface_ready_{0};
  Instant no_room_since_ = Instant::max();
  std::atomic<int> commands_{0};  // a bit for each CellEvent
  CellState state_ = CellState::idle;
  Phase phase_ = Phase::none;
  HoldCause cause_ = HoldCause::none;
  hal::Message why_;
  StartStep start_step_ = StartStep::devices;
  bool begun_ = false, devices_started_ = false, calibrated_ = false;
  bool counting_ = false, has_driven_ = false, arrival_doubted_ = false;
  bool frame_decided_ = false;  // the target that the robot's driver has not written yet

  ShotState shot_state_ = ShotState::parked;
  std::optional<Order> wanted_;
  Order arm_, exposed_, looked_at_;
  bool looking_ = false;   // the background work has a frame, the last or the one that arrives
  bool accepted_ = false;  // it is whole
  hal::Pose standing_;
  std::uint32_t last_number_ = 0, epoch_ = 0, scanner_session_ = 0;

  BoundaryTracker tracker_;
  ShotView view_;
  HeightModel heights_;
  std::vector<ShotPlace> boundary_places_, surface_places_;
  std::size_t surface_planned_ = 0, surface_next_ = 0;
  ZigzagPlan zigzag_;
  bool plan_begun_ = false;  // the zig-zag is begun
  std::array<int, 3> taken_{};
  int retaken_ = 0;
  std::uint64_t points_seen_ = 0;
  CycleTimes cycle_;
  TimeLeft time_left_;
  Duration measuring_{0};  // in Execute, since measure()
  Histogram frame_to_command_, data_age_;
  ClockDrift scanner_clock_;
  hal::LatestValue<CellProgress> published_;
  NoticeQueue notices_;
};

}  // namespace moldloft::tasks
