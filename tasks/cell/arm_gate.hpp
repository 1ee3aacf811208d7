// The one gate to the robot. Every motion to a target goes through send_checked(), which asks the motion
// guard first. A target that the guard refuses is never sent. Nothing else in this room holds a robot that it
// could move; parts that only ask for its state get a const one.
//
// What the robot says of where it stands comes in here as well, and is asked the motion guard too: found(),
// has_arrived() and still_stands() say why a pose is not believed. After one that was not, the robot is synchronised
// again before it is believed anew (clear_fault()).
//
// Thread       the control thread
// Blocking     never
// Allocation   none
// Failure      a target that does not go out says why; what the robot itself answers comes out of next_event()
#pragma once

#include "hal/base/fixed_text.hpp"
#include "hal/base/realtime.hpp"
#include "hal/robot/robot.hpp"
#include "tasks/cell/motion_guard.hpp"

#include <cstdint>
#include <optional>

namespace moldloft::tasks {

class ArmGate {
 public:
  enum class Outcome : std::uint8_t {
    sent,
    refused,    // by the motion guard
    not_taken,  // by the driver: it takes one command at a time, and only while it is ready
  };
  struct Sending {
    Outcome outcome{};
    hal::Message why{};  // for refused: which limit, by how much
  };

  ArmGate(hal::Robot& robot, const Workspace& workspace, int speed_percent, const Arrival& arrival = {})
      : robot_{robot}, workspace_{workspace}, arrival_{arrival}, speed_percent_{speed_percent} {}

  Sending send_checked(const hal::Pose& target, hal::Instant now) MOLDLOFT_NONBLOCKING;
  // The same check, for choosing among targets; nothing when the target may be sent.
  std::optional<hal::Message> refuse(const hal::Pose& target) const MOLDLOFT_NONBLOCKING;

  // Where the arm says that it stands: after it was found or has calibrated, at the end of a motion to `target`, while
  // it was sent nowhere. Nothing when that is believed, else why not.
  std::optional<hal::Message> found(const hal::Pose& reported) MOLDLOFT_NONBLOCKING;
  std::optional<hal::Message> has_arrived(const hal::Pose& reported,
                                          const hal::Pose& target) MOLDLOFT_NONBLOCKING;
  std::optional<hal::Message> still_stands(const hal::Pose& reported) MOLDLOFT_NONBLOCKING;

  void stands_at(const hal::Pose& reported) MOLDLOFT_NONBLOCKING { standing_ = reported; }
  const hal::Pose& standing() const MOLDLOFT_NONBLOCKING { return standing_; }
  bool rests() const MOLDLOFT_NONBLOCKING;  // as far as it can say

  void start(hal::Instant now) MOLDLOFT_NONBLOCKING { robot_.start(now); }
  void calibrate(hal::Instant now) MOLDLOFT_NONBLOCKING { robot_.calibrate(now); }
  void stop(hal::Instant now) MOLDLOFT_NONBLOCKING { robot_.stop(now); }
  void clear_fault(hal::Instant now) MOLDLOFT_NONBLOCKING;  // and what was not believed
  std::optional<hal::RobotEvent> next_event() MOLDLOFT_NONBLOCKING { return robot_.next_event(); }
  const hal::Robot& robot() const MOLDLOFT_NONBLOCKING { return robot_; }

 private:
  hal::Robot& robot_;
  Workspace workspace_;
  Arrival arrival_;
  int speed_percent_;
  hal::Pose standing_;
  bool in_doubt_ = false;
};

}  // namespace moldloft::tasks
