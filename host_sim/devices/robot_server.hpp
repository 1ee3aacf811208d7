// The robot's program as a device: serves the line protocol (hal/PROTOCOLS.md) on a byte link, sans-IO, and
// drives the simulated arm.
//
// At most once: a number that was seen never moves the arm again. Asked again, it brings ACK while the arm
// moves, and afterwards the stored DON or ERR. After power-up, watchdog or e-stop numbered lines are
// refused until SYN.
//
// Thread       one thread; step() as often as time is looked at
// Blocking     never
// Allocation   at construction only
// Failure      none of its own; what a host does wrong is answered by NAK or ERR
#pragma once

#include "hal/links/byte_link.hpp"
#include "hal/robot/robot_line.hpp"
#include "host_sim/arms/arm_drive.hpp"

#include <array>
#include <cstdint>
#include <string_view>

namespace moldloft::host_sim {

struct RobotTimes {
  hal::Duration calibration = std::chrono::seconds{2};
  hal::Duration watchdog = std::chrono::seconds{3};  // without a line motion stops, and SYN is needed
};

struct RobotCounters {
  std::uint64_t motions = 0, calibrations = 0, lines = 0, refused = 0, repeats = 0, watchdogs = 0;
  std::uint32_t most_executions = 0;  // of one number since its SYN: more than 1 breaks the contract
};

// What a robot makes of its encoders before it says where it stands, and whether it obeys. An honest
// robot has none of this.
class RobotWhim {
 public:
  virtual hal::Pose says(const hal::Pose& encoders) const = 0;
  virtual bool stays() const = 0;  // where it is, and confirms motions all the same

 protected:
  ~RobotWhim() = default;
};

class RobotServer {
 public:
  RobotServer(hal::ByteLink&, ArmDrive, const RobotTimes&, const RobotWhim* = nullptr);

  void step(hal::Instant now);
  void power_cycle(hal::Instant now);
  void press_emergency_stop(hal::Instant now);
  // The key on the controller: in manual mode nothing that the host sends moves the arm.
  void turn_key(bool manual, hal::Instant now);
  // Somebody moves the arm by its pendant, and no line tells.
  void jog(const hal::Pose& to, hal::Instant now) { static_cast<void>(drive_.start(to, 100, now)); }
  void release_emergency_stop() noexcept { emergency_stop_ = false; }
  void switch_power(bool on, hal::Instant now);

  // The last command's work: the joints turn in [busy_from, stands_at), then they settle until busy_until.
  hal::Instant busy_from() const noexcept { return busy_from_; }
  hal::Instant stands_at() const noexcept { return stands_at_; }
  hal::Instant busy_until() const noexcept { return busy_until_; }
  const RobotCounters& counters() const noexcept { return counters_; }
  std::uint64_t commands_done() const noexcept { return commands_done_; }
  const ArmDrive& drive() const noexcept { return drive_; }
  // Why the last command was refused, in words that the wire has no room for.
  std::string_view last_refusal() const noexcept { return last_refusal_; }

 private:
  // How the last numbered command stands.
  enum class Fate { none, under_way, done, failed };

  void receive(hal::Instant now);
  void take_line(std::string_view line, hal::Instant now);
  void answer_question(const hal::robot_line::Command&, hal::Instant now);
  void take_numbered(const hal::robot_line::Command&, hal::Instant now);
  void execute(const hal::robot_line::Command&, hal::Instant now);
  void begin_work(hal::Instant now, hal::Instant stands_at, hal::Instant until);
  void finish_work(hal::Instant now);
  void abort_work(hal::robot_line::Error, hal::Instant now);
  bool stands(hal::Instant now) const noexcept { return !working_ && !drive_.moving(now); }
  void watch(hal::Instant now);
  hal::Pose said_pose(hal::Instant now) const;
  void send_fate();
  void send(const hal::robot_line::Reply&);
  void refuse(int number, hal::robot_line::Refusal);
  void raise(hal::robot_line::Event, hal::Instant now);
  void repeat_event(hal::Instant now);
  void flush();

  hal::ByteLink& link_;
  ArmDrive drive_;
  RobotTimes times_;
  const RobotWhim* whim_;
  RobotCounters counters_;

  bool connected_ = false, synchronised_ = false, calibrated_ = false, power_ = true, emergency_stop_ = false;
  bool manual_ = false;
  int last_error_ = 0;
  int last_number_ = 0;
  Fate fate_ = Fate::none;
  bool working_ = false;  // a motion or a calibration is under way, also one whose number a SYN has forgotten
  bool calibrating_ = false;
  int abort_code_ = 0;   // of the work that the brakes are ending; 0: it ends by itself
  int fate_code_ = 0;    // of a command that failed
  hal::Pose fate_pose_;  // of one that is done
  hal::Instant busy_from_{-1}, stands_at_{-1}, busy_until_{-1}, last_line_{0};
  std::uint64_t commands_done_ = 0;
  hal::Message last_refusal_;
  int event_ = 0;  // said once a second until SYN; 0: none
  hal::Instant event_said_{0};
  std::array<std::uint32_t, hal::robot_line::last_number + 1> executions_{};

  std::array<char, hal::robot_line::max_length> line_{};
  std::size_t line_used_ = 0;
  bool line_too_long_ = false;
  std::array<char, 4096> out_{};
  std::size_t out_used_ = 0;
};

}  // namespace moldloft::host_sim
