// The far end of the robot's line for the driver's tests: a robot as PROTOCOLS.md wants it, small enough to
// be read at a glance, with hooks to damage what it says. It counts what really moves.
#pragma once

#include "hal/base/clock.hpp"
#include "hal/links/byte_link.hpp"
#include "hal/robot/robot_line.hpp"

#include <algorithm>
#include <functional>
#include <string>
#include <vector>

namespace moldloft::hal {

class RobotPeer {
 public:
  RobotPeer(ByteLink& link, Clock& clock) : link_{link}, clock_{clock} {}

  // ---- the world around it
  Duration motion_time = 200ms;
  bool mute = false;                                // hears, and says nothing
  std::function<bool(std::string& line)> on_reply;  // may change a line before it goes out; false drops it
  std::function<void(std::string& line)> on_line;   // may damage a line that comes in
  Pose pose{.x_mm = 400, .y_mm = 0, .z_mm = 200, .pitch = 180 * degree};
  robot_line::Status status{.power = true, .mode = robot_line::Status::Mode::calibrated};
  int next_error = 0;  // ERR for the next numbered line

  // ---- what happened
  int motions = 0;
  int calibrations = 0;
  int stops = 0;
  std::vector<std::string> heard;  // good lines, without their checksum
  std::vector<std::uint32_t> nonces;

  void step() {
    if (moving() && clock_.now() >= motion_end_) finish();
    std::array<std::byte, 256> bytes;
    for (std::size_t count; (count = link_.read(bytes)) > 0;) {
      for (std::size_t i = 0; i < count; ++i) take(static_cast<char>(bytes[i]));
    }
  }
  void press_emergency_stop() {
    abort_motion();
    status.emergency_stop = true;
    status.power = false;
    synchronised_ = false;
    say({.verb = robot_line::Verb::evt, .code = static_cast<int>(robot_line::Event::emergency_stop)});
  }
  void release_emergency_stop() {
    status.emergency_stop = false;
    status.power = true;
  }
  // Power gone and back: it stands where it was, and remembers nothing.
  void reboot() {
    abort_motion();
    synchronised_ = false;
    last_number_ = 0;
    line_.clear();
  }
  void say(const robot_line::Reply& reply) { send(std::string{robot_line::format(reply).view()}); }
  void send(std::string line) {
    if (mute || (on_reply && !on_reply(line))) return;
    link_.write(std::as_bytes(std::span{line}));
  }
  bool moving() const { return status.moving; }
  int times_heard(const std::string& beginning) const {
    return static_cast<int>(
        std::ranges::count_if(heard, [&](const std::string& line) { return line.starts_with(beginning); }));
  }

 private:
  using Verb = robot_line::Verb;

  void take(char c) {
    if (c != '\n') {
      line_ += c;
      return;
    }
    std::string line = std::exchange(line_, {});
    if (on_line) on_line(line);
    const auto command = robot_line::parse_command(line);
    if (!command) return say({.verb = Verb::nak, .refusal = robot_line::Refusal::checksum});
    heard.push_back(line.substr(1, line.rfind(" *") - 1));
    command->number == 0 ? answer(*command) : obey(*command);
  }
  void answer(const robot_line::Command& command) {
    if (command.verb == Verb::syn) {
      synchronised_ = true;
      last_number_ = 0;
      nonces.push_back(command.nonce);
    }
    if (command.verb == Verb::stp) {
      ++stops;
      if (moving()) {
        abort_motion();
        outcome_ = {
            .number = last_number_, .verb = Verb::err, .code = static_cast<int>(robot_line::Error::stopped)};
      }
    }
    say({.pose = pose, .answers = command.verb, .status = status, .nonce = command.nonce});
  }
  void obey(const robot_line::Command& command) {
    using robot_line::Refusal;
    if (!synchronised_)
      return say({.number = command.number, .verb = Verb::nak, .refusal = Refusal::not_synchronised});
    if (command.number == last_number_) return say(moving() ? ack() : outcome_);
    if (command.number != robot_line::next_number(last_number_)) {
      return say({.number = command.number,
                  .verb = Verb::nak,
                  .refusal = Refusal::sequence,
                  .last_number = last_number_});
    }
    last_number_ = command.number;
    if (next_error != 0) {
      outcome_ = {.number = last_number_, .verb = Verb::err, .code = std::exchange(next_error, 0)};
      return say(outcome_);
    }
    command.verb == Verb::mov ? ++motions : ++calibrations;
    if (command.verb == Verb::mov) target_ = command.pose;
    status.moving = true;
    motion_end_ = clock_.now() + motion_time;
    say(ack());
  }
  robot_line::Reply ack() const { return {.number = last_number_, .verb = Verb::ack}; }
  void finish() {
    status.moving = false;
    pose = target_;
    outcome_ = {.number = last_number_, .verb = Verb::don, .pose = pose};
    say(outcome_);
  }
  void abort_motion() { status.moving = false; }

  ByteLink& link_;
  Clock& clock_;
  std::string line_;
  bool synchronised_ = false;
  int last_number_ = 0;
  Pose target_ = pose;
  Instant motion_end_{0};
  robot_line::Reply outcome_;
};

}  // namespace moldloft::hal
