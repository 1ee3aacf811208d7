// One shot after another: drive there, expose, deliver; and the same from the archive of an earlier run. The table is
// shot_sequence.hpp; this class carries its actions out.
//
// The ShotUser is the part that wants shots. It orders one at a time, gets the frames, and says when the
// next may come.
//
// Frames       world; poses mm and rad
// Thread       the control thread
// Blocking     never
// Allocation   none
// Failure      a shot that fails is taken again, and holds the cell after `max_attempts`. A target that the
//              motion guard refuses with the head turned either way aborts it
#pragma once

#include "hal/base/realtime.hpp"
#include "hal/record/recorder.hpp"
#include "hal/scanner/scanner.hpp"
#include "tasks/cell/arm_gate.hpp"
#include "tasks/cell/cell_settings.hpp"
#include "tasks/cell/disk_wait.hpp"
#include "tasks/cell/shot_archive.hpp"
#include "tasks/cell/supervisor.hpp"
#include "tasks/machines/shot_sequence.hpp"
#include "tasks/scheduler/clock_drift.hpp"
#include "tasks/scheduler/histogram.hpp"

#include <cstdint>
#include <optional>

namespace moldloft::tasks {

struct ShotOrder {
  std::uint32_t number = 0, shot_id = 0;
  hal::ShotPurpose purpose{};
  ShotPlace place;
  hal::Pose commanded, reported;
  hal::Instant exposed_at{0};
  int attempts = 0;
  bool turned_half = false;  // the other of the two yaws that look the same has been tried
};

class ShotUser {
 public:
  // Nobody reads the frame before, and there is room for what the next one brings.
  virtual bool takes_frame() const MOLDLOFT_NONBLOCKING = 0;
  // A frame that still arrives; `unpacks` holds the points that are not there yet. It becomes whole, or is lost.
  virtual void frame_comes(const ShotOrder&, const hal::Frame&,
                           hal::Scanner* unpacks) MOLDLOFT_NONBLOCKING = 0;
  virtual void frame_is_whole(const ShotOrder&, const hal::Frame&, hal::Scanner* unpacks,
                              bool of_earlier_run) MOLDLOFT_NONBLOCKING = 0;
  // The next shot may be ordered: the arm is free. If only a frame can tell which shot, the order comes
  // after the frame.
  virtual void arm_is_free() MOLDLOFT_NONBLOCKING = 0;
  // A place of the surface whose shot was given up, to be visited once more at the end; false without room for it.
  virtual bool visit_again(const ShotPlace&) MOLDLOFT_NONBLOCKING = 0;

 protected:
  ~ShotUser() = default;
};

class ShotTaker {
 public:
  struct Devices {
    hal::Scanner& scanner;
    ArmGate& arm;
    hal::Recorder& recorder;
    DiskWait& disk;
    const ShotArchive* archive;  // null for none
  };
  ShotTaker(const CellSettings&, Supervisor&, const Devices&, ShotUser&);

  void order(const ShotPlace&, hal::ShotPurpose) MOLDLOFT_NONBLOCKING;  // the next one
  void step() MOLDLOFT_NONBLOCKING;                                     // once a tick in Execute
  void drop_order() MOLDLOFT_NONBLOCKING { ordered_.reset(); }
  void forget() MOLDLOFT_NONBLOCKING;  // all of the run
  bool is_done() const MOLDLOFT_NONBLOCKING { return !ordered_ && state_ == ShotState::parked; }

  // ---- what the devices come to
  void on_arrival(const hal::Pose& reported) MOLDLOFT_NONBLOCKING;
  // Where the arm stands that was sent nowhere; true when a frame that is on its way is not used for it.
  bool on_standing(const hal::Pose& reported) MOLDLOFT_NONBLOCKING;
  void on_refusal(const hal::Message&) MOLDLOFT_NONBLOCKING;  // of a target, by the robot
  void on_exposed(std::uint32_t shot_id) MOLDLOFT_NONBLOCKING;
  void on_arriving(std::uint32_t shot_id) MOLDLOFT_NONBLOCKING;
  void on_frame() MOLDLOFT_NONBLOCKING { apply(ShotEvent::frame); }
  void on_failure(const hal::Message&) MOLDLOFT_NONBLOCKING;  // the scanner's driver has given the shot up

  // ---- from a frame to the target that it decides
  bool waits_for_sending() const MOLDLOFT_NONBLOCKING { return frame_decided_; }
  void commands_sent(hal::Instant now) MOLDLOFT_NONBLOCKING;
  const Histogram& frame_to_command() const { return frame_to_command_; }
  const Histogram& data_age() const { return data_age_; }

  // How many more shots there can be: without devices, those that the earlier run has left.
  std::size_t shots_left() const MOLDLOFT_NONBLOCKING;
  bool has_driven() const { return has_driven_; }
  int retaken() const MOLDLOFT_NONBLOCKING { return retaken_; }
  hal::Instant last_frame() const { return last_frame_; }
  const ClockDrift& scanner_clock() const { return scanner_clock_; }

 private:
  void apply(ShotEvent) MOLDLOFT_NONBLOCKING;
  void carry_out(ShotAction) MOLDLOFT_NONBLOCKING;
  void drive() MOLDLOFT_NONBLOCKING;
  bool pick_pose(ShotOrder&) MOLDLOFT_NONBLOCKING;
  bool send(HoldCause when_refused, const hal::Message& when_not_taken) MOLDLOFT_NONBLOCKING;
  void trigger() MOLDLOFT_NONBLOCKING;
  void release_arm() MOLDLOFT_NONBLOCKING;
  void deliver() MOLDLOFT_NONBLOCKING;
  bool deliver_archived() MOLDLOFT_NONBLOCKING;
  void skip_given_up() MOLDLOFT_NONBLOCKING;
  bool awaits_frame() const MOLDLOFT_NONBLOCKING;
  bool may_expose() const MOLDLOFT_NONBLOCKING;
  bool is_of_earlier_run(const ShotOrder&) const MOLDLOFT_NONBLOCKING;

  const CellSettings& settings_;
  Supervisor& supervisor_;
  hal::Scanner& scanner_;
  ArmGate& arm_gate_;
  hal::Recorder& recorder_;
  DiskWait& disk_;
  const ShotArchive* archive_;
  ShotUser& user_;

  ShotState state_ = ShotState::parked;
  std::optional<ShotOrder> ordered_;
  ShotOrder arm_, exposed_;  // where the arm is or goes; the last that was exposed
  std::uint32_t last_number_ = 0, epoch_ = 0, scanner_session_ = 0;
  int retaken_ = 0;
  hal::Instant last_frame_{0};
  bool arrival_doubted_ = false, has_driven_ = false;
  bool frame_decided_ = false;  // the target that the robot's driver has not written yet
  Histogram frame_to_command_, data_age_;
  ClockDrift scanner_clock_;
};

}  // namespace moldloft::tasks
