// Whole runs with devices that do not say the truth: what cannot be is not believed, in one true line, and no shot is
// used that was taken with it.
#include "firmware_like/process/complaint.hpp"
#include "host_sim/scripted_run.hpp"

#include <doctest/doctest.h>

using namespace moldloft;
using namespace moldloft::host_sim;
using namespace std::chrono_literals;

namespace {

std::string message(const SimulatedRun& run) { return run.summary["message"]; }

}  // namespace

TEST_CASE("a robot that says what cannot be holds the cell with what it said, and nothing is exposed there") {
  const struct {
    const char *fault, *says;
    std::uint64_t exposures;
  } lies[] = {
      {"robot-lies 5 at 4", "arrived 5.00 mm and 0.00 degrees off its target", 3},
      {"robot-lies 50 at 9", "arrived 50.00 mm and 0.00 degrees off its target", 8},
      {"robot-lies 0.4", "arrived 0.40 mm and 0.00 degrees off its target", 0},
      {"robot-tilts 0.1 at 6", "arrived 0.00 mm and 0.10 degrees off its target", 5},
      {"robot-tilts 90 from 2", "arrived 0.00 mm and 90.00 degrees off its target", 1},
      {"robot-lies 2 from surface", "arrived 2.00 mm and 0.00 degrees off its target", 0},
  };
  for (const auto& lie : lies) {
    CAPTURE(lie.fault);
    ScriptedRun cell;
    cell.options.cell.faults = faults_from(lie.fault).value();
    const auto run = cell.run();
    CHECK(run.exit_code == firmware_like::exit_held);
    CHECK(message(run).find(lie.says) != std::string::npos);
    const auto used = run.summary["shots"]["seek"].get<std::uint64_t>() +
                      run.summary["shots"]["boundary"].get<std::uint64_t>() +
                      run.summary["shots"]["surface"].get<std::uint64_t>();
    CHECK(cell.exposures == used);
    if (std::string{lie.fault}.ends_with("surface")) {
      CHECK(run.summary["shots"]["surface"] == 0);
    } else {
      CHECK(cell.exposures == lie.exposures);
    }
  }
}

TEST_CASE("an arm that is found where no arm can stand is held and not moved") {
  ScriptedRun cell;
  cell.options.cell.faults = faults_from("robot-lies 5000").value();
  const auto run = cell.run();
  CHECK(run.exit_code == firmware_like::exit_held);
  CHECK(message(run).find("the robot says it stands at ") == 0);
  CHECK(message(run).find("raise [robot.workspace] parked_mm") != std::string::npos);
  CHECK(cell.motions == 0);
  CHECK(cell.exposures == 0);
}

TEST_CASE(
    "a robot that confirms motions and stays is found out by where it stands, and its shot is not used") {
  ScriptedRun cell;
  cell.options.cell.faults = faults_from("robot-stays from 4").value();
  const auto run = cell.run();
  CHECK(run.exit_code == firmware_like::exit_held);
  CHECK(message(run).find("the robot says it stands ") == 0);
  CHECK(message(run).find("from where it said it stopped") != std::string::npos);
  CHECK(cell.exposures == 4);  // the fourth was taken where it had never gone
  CHECK(run.summary["shots"]["seek"].get<int>() + run.summary["shots"]["boundary"].get<int>() == 3);
  CHECK(cell.motions == 3);
}

TEST_CASE("a lie within the bounds is used as it is, and the plate stays within the limits") {
  ScriptedRun cell;
  cell.options.cell.faults = faults_from("robot-lies 0.12 at 8, robot-tilts 0.02 at 11").value();
  const auto run = cell.run();
  CHECK(run.exit_code == firmware_like::exit_done);
  check_truth(run.summary);
}

TEST_CASE("somebody who moves the arm while it waits is noticed, and the shot is taken once more") {
  ScriptedRun cell, undisturbed;
  // Time enough at each place for somebody to move the arm and let go of it again.
  for (auto* run : {&cell, &undisturbed}) run->options.cell.scanner_times.processing = 400ms;
  cell.options.held = true;  // somebody is there
  int told = 0;
  std::string said;
  bool pushed = false, mended = false;
  const auto run = cell.run([&](const SimulatedCell& c, hal::Instant now) {
    auto& controlled = c.controller.cell();
    if (controlled.state() == tasks::CellState::held && controlled.cause() == tasks::HoldCause::person &&
        (told == 0 || (pushed && !mended))) {
      ++told;
      mended = pushed;
      if (pushed) said = controlled.why().view();
      return controlled.command(tasks::CellEvent::unhold);
    }
    const auto& scanner = c.world.scanner();
    if (!pushed && scanner.counters().exposures == 5 && now > c.world.robot().busy_until() + 20ms &&
        now < scanner.busy_until() - 300ms) {
      pushed = true;
      hal::Pose beside = c.world.robot().drive().reported_pose(now);
      beside.x_mm += 1.5;
      c.world.robot().jog(beside, now);
    }
  });
  CHECK(pushed);
  CAPTURE(said);
  CHECK(mended);
  // It is asked while it still moves: 1.5 mm at the end, a little less then.
  CHECK(said.find("the robot says it stands 1.") == 0);
  CHECK(said.find(" mm and 0.00 degrees from where it said it stopped") != std::string::npos);
  CHECK(run.exit_code == firmware_like::exit_done);
  check_truth(run.summary);
  // The place is driven to once more, and exposed once more.
  const auto plain = undisturbed.run();
  CHECK(cell.motions == undisturbed.motions + 1);
  CHECK(cell.exposures == undisturbed.exposures + 1);
  CHECK(run.summary["shots"]["boundary"] == plain.summary["shots"]["boundary"]);
}
