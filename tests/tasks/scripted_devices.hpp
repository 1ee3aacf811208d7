// A scanner and a robot that do what a test says, and remember what they were asked.
#pragma once

#include "hal/robot/robot.hpp"
#include "hal/scanner/scanner.hpp"

#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>
#include <string_view>
#include <vector>

namespace moldloft::tasks {

class ScriptedRobot final : public hal::Robot {
 public:
  hal::RobotState is = hal::RobotState::ready;
  std::deque<hal::RobotEvent> events;
  std::vector<hal::Pose> moves;
  int starts = 0, calibrations = 0, stops = 0;

  void start(hal::Instant) override { ++starts; }
  void receive(hal::Instant) override {}
  void transmit(hal::Instant) override {}
  bool move(const hal::Pose& target, int, hal::Instant) override {
    if (is != hal::RobotState::ready) return false;
    moves.push_back(target);
    return true;
  }
  bool calibrate(hal::Instant) override {
    ++calibrations;
    is = hal::RobotState::moving;
    return true;
  }
  void stop(hal::Instant) override { ++stops; }
  void reset(hal::Instant) override {}
  std::optional<hal::RobotEvent> next_event() override {
    if (events.empty()) return std::nullopt;
    const auto event = events.front();
    events.pop_front();
    return event;
  }
  hal::RobotState state() const override { return is; }
  std::string_view why() const override { return "robot: nobody answers"; }
  std::size_t plan_bytes() const override { return 0; }
};

class ScriptedScanner final : public hal::Scanner {
 public:
  hal::ScannerState is = hal::ScannerState::ready;
  hal::ScannerInfo says;
  std::deque<hal::ScannerEvent> events;
  std::vector<std::uint32_t> triggers;
  hal::Frame last{1, 1};
  int starts = 0, forgotten = 0;

  void start(hal::Instant) override { ++starts; }
  void receive(hal::Instant) override {}
  void transmit(hal::Instant) override {}
  bool trigger(std::uint32_t shot_id, hal::Instant) override {
    triggers.push_back(shot_id);
    return true;
  }
  void forget_shot() override { ++forgotten; }
  std::optional<hal::ScannerEvent> next_event() override {
    if (events.empty()) return std::nullopt;
    const auto event = events.front();
    events.pop_front();
    return event;
  }
  hal::ScannerState state() const override { return is; }
  const hal::ScannerInfo& info() const override { return says; }
  const hal::Frame& frame() const override { return last; }
  void unpack(std::size_t) override {}
  std::size_t unpacked() const override { return last.point_count; }
  std::size_t packed() const override { return 0; }
  std::uint64_t frame_offset() const override { return 0; }
  std::uint32_t frame_bytes() const override { return 0; }
  std::string_view why() const override { return "scanner: nobody answers"; }
  std::size_t plan_bytes() const override { return 0; }
};

}  // namespace moldloft::tasks
