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
// Thread       the control thread: receive() early in a tick, transmit() late in it
// Blocking     never
// Allocation   none
// Failure      offline links are opened again after `back_off`; an arm silent for `silence` is lost; a line that is
//              none of the above is dropped, and the time-out that follows says so
#pragma once

#include "hal/base/event_queue.hpp"
#include "hal/links/byte_link.hpp"
#include "hal/robot/robot.hpp"

namespace own {

namespace hal = moldloft::hal;

class OwnRobot final : public hal::Robot {
 public:
  struct Settings {
    hal::Duration back_off = std::chrono::milliseconds{500};  // a controller's port is back within a second
    hal::Duration question = std::chrono::seconds{1};  // between two ?, which show that the arm is there
    hal::Duration silence = std::chrono::seconds{3};   // three of them, unanswered
    hal::Duration answer =
        std::chrono::milliseconds{500};              // A after M: two full lines take 30 ms at 115200 baud
    hal::Duration motion = std::chrono::minutes{2};  // the longest way at the lowest speed
  };

  explicit OwnRobot(hal::ByteLink& link) : OwnRobot{link, Settings{}} {}
  OwnRobot(hal::ByteLink& link, const Settings& settings) : link_{link}, settings_{settings} {}

  void start(hal::Instant now) MOLDLOFT_NONBLOCKING override;
  void receive(hal::Instant now) MOLDLOFT_NONBLOCKING override;
  void transmit(hal::Instant now) MOLDLOFT_NONBLOCKING override;
  bool move(const hal::Pose& target, int speed_percent, hal::Instant now) MOLDLOFT_NONBLOCKING override;
  bool calibrate(hal::Instant now) MOLDLOFT_NONBLOCKING override;  // this arm always knows where it is
  void stop(hal::Instant now) MOLDLOFT_NONBLOCKING override;
  void reset(hal::Instant now) MOLDLOFT_NONBLOCKING override;

  std::optional<hal::RobotEvent> next_event() MOLDLOFT_NONBLOCKING override { return events_.pop(); }
  hal::RobotState state() const MOLDLOFT_NONBLOCKING override { return state_; }
  std::string_view why() const MOLDLOFT_NONBLOCKING override { return why_; }
  std::size_t plan_bytes() const MOLDLOFT_NONBLOCKING override { return sizeof(*this); }

 private:
  using Line = hal::FixedText<120>;

  void open(hal::Instant now) MOLDLOFT_NONBLOCKING;
  void lose(std::string_view why, hal::Instant now) MOLDLOFT_NONBLOCKING;
  void fail(std::string_view why) MOLDLOFT_NONBLOCKING;
  void say(std::string_view line) MOLDLOFT_NONBLOCKING;
  void take(std::string_view line, hal::Instant now) MOLDLOFT_NONBLOCKING;
  bool has_command() const MOLDLOFT_NONBLOCKING {
    return state_ == hal::RobotState::commanded || state_ == hal::RobotState::moving;
  }

  hal::ByteLink& link_;
  Settings settings_;
  hal::EventQueue<hal::RobotEvent, 8> events_;
  hal::RobotState state_ = hal::RobotState::offline;
  hal::Message why_{"not started"};
  bool started_ = false, opening_ = false, latched_ = false;
  hal::Instant open_at_{}, asked_{}, heard_{}, command_until_{};
  std::array<char, 480> out_{};  // three of the longest lines: a command, a question, a stop
  std::size_t out_size_ = 0;
  std::array<char, 120> in_{};
  std::size_t in_size_ = 0;
};

}  // namespace own
