#include "tasks/cell/device_start.hpp"

#include "tasks/scripted_devices.hpp"

#include <doctest/doctest.h>

#include <string>
#include <vector>

using namespace moldloft;
using namespace moldloft::tasks;
using namespace std::chrono_literals;

namespace {

struct Bench final : CellActions {
  Bench() {
    scanner.is = hal::ScannerState::offline;
    robot.is = hal::RobotState::offline;
    scanner.says = {.field_x_mm = 102, .field_y_mm = 102, .depth_mm = 60};
    settings.tracker.field_half_x_mm = settings.tracker.field_half_y_mm = 51;
    settings.device_timeout = 10s;
  }
  void carry_out(CellAction action) override {
    actions.push_back(action);
    if (action == CellAction::connect_and_calibrate) start.begin();
  }
  void begin(hal::Instant now) {
    supervisor.begin_tick(now);
    supervisor.command(CellEvent::start);
    supervisor.take_up_command();
  }
  CellState tick(hal::Instant now) {
    supervisor.begin_tick(now);
    if (supervisor.state() == CellState::starting) start.step();
    return supervisor.state();
  }
  void robot_synchronises(bool calibrated) {
    robot.is = hal::RobotState::ready;
    start.robot_is_ready(calibrated);
  }

  CellSettings settings;
  ScriptedRobot robot;
  ScriptedScanner scanner;
  hal::Recorder recorder{{.bulk_bytes = 1u << 16, .events_bytes = 1u << 16, .largest_frame_bytes = 1u << 12}};
  std::vector<CellAction> actions;
  Supervisor supervisor{recorder, *this};
  ArmGate gate{robot, settings.workspace, 100};
  DeviceStart start{settings, supervisor, scanner, gate};
};

std::string why(const Bench& b) { return std::string{b.supervisor.why().view()}; }

}  // namespace

TEST_CASE(
    "an arm that knows where it stands is not calibrated, and the run begins in the tick in which both are "
    "there") {
  Bench b;
  b.begin(0s);
  CHECK(b.scanner.starts == 1);
  CHECK(b.robot.starts == 1);
  CHECK(b.tick(1s) == CellState::starting);
  b.robot_synchronises(true);
  CHECK(b.tick(2s) == CellState::starting);
  b.scanner.is = hal::ScannerState::ready;
  CHECK(b.tick(3s) == CellState::execute);
  CHECK(b.robot.calibrations == 0);
}

TEST_CASE("an arm that does not know where it stands calibrates once, for as long as it takes") {
  Bench b;
  b.scanner.is = hal::ScannerState::ready;
  b.begin(0s);
  b.robot_synchronises(false);
  CHECK(b.tick(1s) == CellState::starting);
  CHECK(b.robot.calibrations == 1);
  CHECK(b.start.calibrates());
  CHECK(b.tick(100s) == CellState::starting);  // longer than the time-out for a device
  b.robot.is = hal::RobotState::ready;
  CHECK(b.start.takes_end_of_motion());
  CHECK(b.tick(101s) == CellState::execute);
  CHECK(b.robot.calibrations == 1);
  CHECK_FALSE(b.start.takes_end_of_motion());  // of the first shot's motion
}

TEST_CASE("a device that stays away for the time-out aborts, and is named") {
  Bench b;
  b.begin(0s);
  SUBCASE("the scanner") {
    b.robot_synchronises(true);
    CHECK(b.tick(10s) == CellState::starting);
    CHECK(b.tick(10s + 1ns) == CellState::aborting);
    CHECK(why(b) == "scanner: nobody answers");
  }
  SUBCASE("the robot") {
    b.scanner.is = hal::ScannerState::ready;
    CHECK(b.tick(10s) == CellState::starting);
    CHECK(b.tick(10s + 1ns) == CellState::aborting);
    CHECK(why(b) == "robot: nobody answers");
  }
  SUBCASE("the scanner while the arm calibrates: from when it was lost") {
    b.scanner.is = hal::ScannerState::ready;
    b.robot_synchronises(false);
    CHECK(b.tick(5s) == CellState::starting);
    CHECK(b.tick(60s) == CellState::starting);
    b.scanner.is = hal::ScannerState::offline;
    CHECK(b.tick(70s) == CellState::starting);
    CHECK(b.tick(70s + 1ns) == CellState::aborting);
  }
}

TEST_CASE("a scanner of another field or depth aborts before anything moves, with what to correct") {
  Bench b;
  b.scanner.is = hal::ScannerState::ready;
  b.begin(0s);
  b.robot_synchronises(false);
  SUBCASE("field") {
    b.scanner.says.field_x_mm = 104;
    CHECK(b.tick(1s) == CellState::aborting);
    CHECK(why(b) ==
          "scanner reports a field of 104.0 x 102.0 mm: correct [scanner] field_mm = [102.0, 102.0]");
  }
  SUBCASE("depth") {
    b.scanner.says.depth_mm = 59;
    CHECK(b.tick(1s) == CellState::aborting);
    CHECK(why(b) == "scanner measures 59.0 mm to each side in height: correct [scanner] depth_mm = 60.0");
  }
  CHECK(b.supervisor.cause() == HoldCause::measurement);
  CHECK(b.robot.calibrations == 0);
}

TEST_CASE("a cell that has aborted and is started again connects once and looks at both devices anew") {
  Bench b;
  b.begin(0s);
  CHECK(b.tick(11s) == CellState::aborting);
  b.supervisor.done();
  for (const auto event : {CellEvent::clear, CellEvent::reset}) {
    b.supervisor.command(event);
    b.supervisor.take_up_command();
    b.supervisor.done();
  }
  CHECK(b.supervisor.state() == CellState::idle);
  b.begin(100s);
  CHECK(b.tick(109s) == CellState::starting);
  b.scanner.is = hal::ScannerState::ready;
  b.robot_synchronises(true);
  CHECK(b.tick(110s) == CellState::execute);
  CHECK(b.scanner.starts == 1);
  CHECK(b.robot.starts == 1);
}

TEST_CASE("without devices a run begins at once, and none is asked for anything") {
  Bench b;
  b.settings.devices = false;
  b.begin(0s);
  CHECK(b.tick(1ms) == CellState::execute);
  CHECK(b.scanner.starts == 0);
  CHECK(b.robot.starts == 0);
}
