// Devices that are there and do not do what the cell expects: what it says, and what it does not do.
#include "firmware_like/process/complaint.hpp"
#include "hal/robot/robot_line.hpp"
#include "host_sim/scripted_run.hpp"

#include <doctest/doctest.h>

#include <fstream>
#include <map>
#include <set>

using namespace moldloft;
using namespace moldloft::host_sim;
using namespace std::chrono_literals;
using tasks::CellEvent;
using tasks::CellState;
using tasks::HoldCause;

namespace {

std::string message(const SimulatedRun& run) { return run.summary["message"]; }
int boundary_shots(const SimulatedCell& cell) {
  return cell.controller.cell().shots_taken(hal::ShotPurpose::boundary);
}

// The robot's next DON says something else than it should: the line is sent by the robot's end before the true one.
void report_elsewhere(const SimulatedCell& cell, int number, const hal::Pose& pose) {
  const auto line = hal::robot_line::format(
      hal::robot_line::Reply{.number = number, .verb = hal::robot_line::Verb::don, .pose = pose});
  REQUIRE_FALSE(line.empty());
  cell.robot_cable.device().write(std::as_bytes(std::span{line.view()}));
}

}  // namespace

TEST_CASE("a robot in manual mode is held at the start, by that name, and neither CAL nor MOV is sent") {
  ScriptedRun cell;
  hal::Instant ended{0};
  std::uint64_t calibrations = 0;
  const auto run = cell.run([&](const SimulatedCell& c, hal::Instant now) {
    if (now < 2ms) c.world.robot().turn_key(true, now);
    calibrations = c.world.robot().counters().calibrations;
    ended = now;
  });
  CHECK(run.exit_code == firmware_like::exit_held);
  CHECK(message(run) == "robot: it is in manual mode; switch it to automatic, then go on");
  CHECK(cell.motions + calibrations == 0);
  CHECK(ended < 10s);  // at once, not after the time for devices that do not answer
}

TEST_CASE(
    "a start that was held in manual mode begins again with unhold, and holds again while it is too early") {
  ScriptedRun cell;
  cell.options.held = true;  // somebody is there
  int told = 0;
  bool held_at_start = false;
  hal::Instant next{0};
  const auto run = cell.run([&](const SimulatedCell& c, hal::Instant now) {
    if (now < 2ms) c.world.robot().turn_key(true, now);
    auto& controlled = c.controller.cell();
    if (controlled.state() != CellState::held || now < next) return;
    held_at_start =
        held_at_start || (told > 0 && controlled.why().view().find("manual") != std::string_view::npos);
    CHECK(cell.motions + c.world.robot().counters().calibrations == 0);
    if (told == 2) c.world.robot().turn_key(false, now);
    next = now + 2s;
    if (++told <= 6) controlled.command(CellEvent::unhold);
  });
  CHECK(held_at_start);
  CHECK(told == 3);  // begun, once too early, and with the key turned back
  CHECK(run.exit_code == firmware_like::exit_done);
  check_truth(run.summary);
}

TEST_CASE("the key turned to manual in mid-motion aborts the cell, and the arm stands") {
  ScriptedRun cell;
  bool turned = false;
  std::uint64_t before = 0;
  const auto run = cell.run([&](const SimulatedCell& c, hal::Instant now) {
    const auto& robot = c.world.robot();
    if (turned || boundary_shots(c) < 2 || now <= robot.busy_from() || now >= robot.stands_at()) return;
    turned = true;
    before = robot.counters().motions;
    c.world.robot().turn_key(true, now);
  });
  CHECK(turned);
  CHECK(run.exit_code == firmware_like::exit_aborted);
  CHECK(message(run).find("manual mode") != std::string::npos);
  CHECK(cell.motions == before);
}

TEST_CASE(
    "an arm that says it has arrived elsewhere is not believed: no shot is taken there, the cell holds") {
  const struct {
    const char *of, *says;
    hal::Pose (*elsewhere)(hal::Pose);
  } wrong[] = {
      {"digits that changed", "mm and 0.00 degrees off its target",
       [](hal::Pose p) { return p.x_mm = 999999.999, p; }},
      {"a pitch of 90", "0.00 mm and 90.00 degrees off its target",
       [](hal::Pose p) { return p.pitch = 90 * hal::degree, p; }},
      {"a wrong tool", "6.00 mm and 0.00 degrees off its target", [](hal::Pose p) { return p.z_mm += 6, p; }},
      {"a turned head", "0.00 mm and 3.00 degrees off its target",
       [](hal::Pose p) { return p.roll += 3 * hal::degree, p; }},
  };
  for (const auto& w : wrong) {
    CAPTURE(w.of);
    ScriptedRun cell;
    std::size_t shots_before = 0;
    bool said = false;
    const auto run = cell.run([&](const SimulatedCell& c, hal::Instant now) {
      const auto& robot = c.world.robot();
      if (said || boundary_shots(c) < 2 || now <= robot.stands_at() || now >= robot.busy_until()) return;
      said = true;
      shots_before = static_cast<std::size_t>(c.world.scanner().counters().exposures);
      // CAL had number 1.
      report_elsewhere(c, static_cast<int>(robot.counters().motions) + 1,
                       w.elsewhere(robot.drive().reported_pose(now)));
    });
    REQUIRE(said);
    CHECK(run.exit_code == firmware_like::exit_held);
    CAPTURE(message(run));
    CHECK(message(run).find(w.says) != std::string::npos);
    CHECK(message(run).find("[robot] arrival_mm, arrival_deg: 0.15, 0.03") != std::string::npos);
    CHECK(cell.exposures == shots_before);
  }
}

TEST_CASE("angles that say the same in other numbers are the same place") {
  // Of ZYZ' angles with the tool straight down only yaw - roll counts.
  for (const double turn : {90.0, -170.0, 360.0}) {
    ScriptedRun cell;
    bool said = false;
    const auto run = cell.run([&](const SimulatedCell& c, hal::Instant now) {
      const auto& robot = c.world.robot();
      if (said || boundary_shots(c) < 2 || now <= robot.stands_at() || now >= robot.busy_until()) return;
      said = true;
      hal::Pose pose = robot.drive().reported_pose(now);
      pose.yaw += turn * hal::degree;
      pose.roll += turn * hal::degree;
      report_elsewhere(c, static_cast<int>(robot.counters().motions) + 1, pose);
    });
    REQUIRE(said);
    CHECK(run.exit_code == firmware_like::exit_done);
  }
}

TEST_CASE(
    "after a doubtful arrival the same target is driven to once more, and the run completes as undisturbed") {
  ScriptedRun cell, undisturbed;
  cell.options.held = true;  // somebody is there
  bool said = false, unheld = false;
  hal::Instant said_at{0};
  int told = 0;
  const auto run = cell.run([&](const SimulatedCell& c, hal::Instant now) {
    auto& controlled = c.controller.cell();
    const auto& robot = c.world.robot();
    if (controlled.state() == CellState::held && told < 1)
      return ++told, controlled.command(CellEvent::unhold);
    if (!said && boundary_shots(c) >= 2 && now > robot.stands_at() && now < robot.busy_until()) {
      said = true;
      said_at = now;
      hal::Pose pose = robot.drive().reported_pose(now);
      pose.z_mm += 20;
      report_elsewhere(c, static_cast<int>(robot.counters().motions) + 1, pose);
    }
    if (said && !unheld && now > said_at + 1s && controlled.state() == CellState::held) {
      unheld = true;
      controlled.command(CellEvent::unhold);
    }
  });
  CHECK(unheld);
  CHECK(run.exit_code == firmware_like::exit_done);
  check_truth(run.summary);
  const auto plain = undisturbed.run();
  CHECK(run.summary["shots"]["boundary"] == plain.summary["shots"]["boundary"]);
  CHECK(cell.motions == undisturbed.motions + 1);
}

TEST_CASE(
    "a scanner that is lost for good: what is waited for is said, and after the limit the run ends, held") {
  ScriptedRun cell;
  cell.set("name", "name = \"lost\"\nscanner_wait_s = 40");
  hal::Instant cut{0}, ended{0};
  std::string while_waiting;
  const auto run = cell.run([&](const SimulatedCell& c, hal::Instant now) {
    if (cut == 0ns && boundary_shots(c) == 3) {
      cut = now;
      c.scanner_cable.cut();
    }
    if (c.controller.cell().cause() == HoldCause::scanner) while_waiting = c.controller.cell().why().view();
    ended = now;
  });
  CHECK(run.exit_code == firmware_like::exit_held);
  CHECK(while_waiting == "the cable is cut; waiting 40 s for it to come back (ctrl-C ends the run)");
  CHECK(message(run) == "no scanner for 40 s (the cable is cut): bring it back, then go on");
  CHECK(ended - cut > 40s);
  CHECK(ended - cut < 45s);

  cell.options.resume = true;
  CHECK(cell.run().exit_code == firmware_like::exit_done);
}

TEST_CASE("where somebody can command the cell a lost scanner is waited for as long as it takes") {
  ScriptedRun cell;
  cell.options.held = true;
  cell.set("name", "name = \"lost\"\nscanner_wait_s = 1");
  hal::Instant cut{0};
  bool told = false, mended = false;
  std::string while_waiting;
  const auto run = cell.run([&](const SimulatedCell& c, hal::Instant now) {
    auto& controlled = c.controller.cell();
    if (!told && controlled.state() == CellState::held)
      return told = true, controlled.command(CellEvent::unhold);
    if (cut == 0ns && boundary_shots(c) == 3) {
      cut = now;
      c.scanner_cable.cut();
    }
    if (controlled.cause() == HoldCause::scanner) while_waiting = controlled.why().view();
    if (cut > 0ns && !mended && now > cut + 6min) {
      mended = true;
      c.scanner_cable.mend();
    }
  });
  CHECK(mended);
  CHECK(while_waiting == "the cable is cut; waiting until it is back (stop ends the run)");
  CHECK(run.exit_code == firmware_like::exit_done);
}

TEST_CASE(
    "a scanner whose frames, field or depth are not the configuration's is refused at once, by the key") {
  const struct {
    const char *begins, *line, *says;
  } wrong[] = {
      {"max_stripes", "max_stripes = 99",
       "the scanner's frames have 100 stripes of 500 points, more than [scanner] max_stripes, "
       "max_points_per_stripe "
       "allow (49500 points): raise them"},
      {"depth_mm", "depth_mm = 75", "correct [scanner] depth_mm = 75.0"},
      {"field_mm", "field_mm = [110, 102]", "correct [scanner] field_mm = [110.0, 102.0]"},
  };
  for (const auto& w : wrong) {
    CAPTURE(w.line);
    ScriptedRun cell;
    cell.set(w.begins, w.line);
    hal::Instant ended{0};
    const auto run = cell.run([&](const SimulatedCell&, hal::Instant now) { ended = now; });
    CHECK(run.exit_code == firmware_like::exit_aborted);
    CAPTURE(message(run));
    CHECK(message(run).ends_with(w.says));
    CHECK(ended < 5s);
    CHECK(cell.motions == 0);
  }
}

TEST_CASE("whom the cell waits for at the start shows in its progress") {
  ScriptedRun cell;
  std::set<std::string> waits;
  cell.run([&](const SimulatedCell& c, hal::Instant now) {
    if (now < 2ms) c.robot_cable.cut();
    const auto progress = c.controller.cell().progress();
    if (progress.awaited == tasks::Awaited::robot) waits.emplace(progress.awaited_why.view());
  });
  CHECK(waits.contains("the cable is cut"));
}

TEST_CASE("a run that is complete is not resumed: one line says so, and not a byte of its folder changes") {
  ScriptedRun cell;
  REQUIRE(cell.run().exit_code == firmware_like::exit_done);
  const hal::TemporaryFolder folder;
  {
    std::ofstream config{folder.file("cell.toml")};
    config << "[robot]\ndevice = \"" << folder.file("no robot") << "\"\n";
  }
  const auto bytes = [&] {
    std::map<std::string, std::string> all;
    for (const auto& entry : std::filesystem::directory_iterator{cell.folder()})
      all[entry.path().filename()] = text_of(entry.path());
    return all;
  };
  const auto before = bytes();
  for (const std::vector<std::string>& how :
       {std::vector<std::string>{"--resume"}, {"--resume-held", "--control", folder.file("socket")}}) {
    std::vector<std::string> words{MOLDLOFT, "run", folder.file("cell.toml"), "--out", cell.folder()};
    words.insert(words.end(), how.begin(), how.end());
    const Finished program = run_program(words);
    CHECK(program.exit_code == firmware_like::exit_done);
    CHECK(program.out.empty());
    CHECK(program.err == "moldloft: " + cell.folder() +
                             ": this run is complete, nothing is left to measure; `moldloft report " +
                             cell.folder() + "` shows it, another plate needs another --out\n");
    CHECK(bytes() == before);
  }
}
