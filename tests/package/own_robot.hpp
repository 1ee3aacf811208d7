// A robot driver of one's own: what it takes to drive another make of arm, small enough to read in one sitting.
//
// The arm of this example speaks lines over any byte link, millimetres and degrees, poses as in hal/robot/pose.hpp:
//
//     ?                                -> P X Y Z YAW PITCH ROLL     where it stands; answered at any time
//     M X Y Z YAW PITCH ROLL SPEED     -> A, and when it stands again D X Y Z YAW PITCH ROLL, or E CODE
//     S                                -> the motion ends as fast as it can, with E 1
//
// Its lines carry no number and no checksum. So a command whose fate is not known is never said again (it might move
// the arm twice): it is a fault, latched until a person has looked and reset() is called.
//
// Connecting, back-off, outbox and heartbeat are hal/links/device_session's. What stands here is what this make alone
// knows: its words, and what they mean.
//
// Thread       the control thread: receive() early in a tick, transmit() late in it
// Blocking     never; only the link's open() and close() may
// Allocation   the session's outbox, in the constructor
// Failure      an arm that stays silent is lost and found again by the session; a line that is none of the above is
//              dropped and counted, and the time-out that follows says so
#pragma once

#include "hal/base/event_queue.hpp"
#include "hal/links/device_session.hpp"
#include "hal/robot/robot.hpp"

namespace own {

namespace hal = moldloft::hal;

class OwnRobot final : public hal::Robot {
 public:
  struct Settings {
    // Between two ?, which show that the arm is there. It is lost when three of them stay unanswered.
    hal::Duration question = std::chrono::seconds{1}, silence = std::chrono::seconds{3};
    // A after M: two full lines take 30 ms at 115200 baud.
    hal::Duration answer = std::chrono::milliseconds{500};
    hal::Duration motion = std::chrono::minutes{2};  // the longest way at the lowest speed
  };

  explicit OwnRobot(hal::ByteLink& link) : OwnRobot{link, Settings{}} {}
  OwnRobot(hal::ByteLink&, const Settings&);

  void start(hal::Instant now) MOLDLOFT_NONBLOCKING override { session_.start(now); }
  void receive(hal::Instant now) MOLDLOFT_NONBLOCKING override;
  void transmit(hal::Instant now) MOLDLOFT_NONBLOCKING override;
  bool move(const hal::Pose& target, int speed_percent, hal::Instant now) MOLDLOFT_NONBLOCKING override;
  bool calibrate(hal::Instant now) MOLDLOFT_NONBLOCKING override;  // this arm always knows where it is
  void stop(hal::Instant now) MOLDLOFT_NONBLOCKING override;
  void reset(hal::Instant now) MOLDLOFT_NONBLOCKING override;

  std::optional<hal::RobotEvent> next_event() MOLDLOFT_NONBLOCKING override { return events_.pop(); }
  hal::RobotState state() const MOLDLOFT_NONBLOCKING override { return state_; }
  std::string_view why() const MOLDLOFT_NONBLOCKING override { return why_; }
  hal::LossCounts losses() const override { return {{"unexpected lines", unexpected_lines_}}; }
  std::size_t plan_bytes() const MOLDLOFT_NONBLOCKING override {
    return sizeof(*this) + session_.plan_bytes();
  }

 private:
  using Line = hal::FixedText<120>;

  void lose(std::string_view why, hal::Instant now) MOLDLOFT_NONBLOCKING;
  void fail(std::string_view why) MOLDLOFT_NONBLOCKING;
  void say(std::string_view words) MOLDLOFT_NONBLOCKING;
  bool take(std::string_view line, hal::Instant now) MOLDLOFT_NONBLOCKING;  // false: it means nothing here
  bool has_command() const MOLDLOFT_NONBLOCKING {
    return state_ == hal::RobotState::commanded || state_ == hal::RobotState::moving;
  }

  hal::DeviceSession session_;
  const Settings settings_;
  hal::EventQueue<hal::RobotEvent, 8> events_;
  hal::RobotState state_ = hal::RobotState::offline;
  hal::Message why_{"not started"};
  bool latched_ = false;
  hal::Instant command_until_{};
  std::array<char, 120> in_{};
  std::size_t in_size_ = 0;
  std::uint64_t unexpected_lines_ = 0;
};

}  // namespace own
