// What goes wrong, as DESIGN section 4 lists it, one case each: the cell under virtual time with a script
// that breaks something. The invariants are ScriptedRun's.
#include "firmware_like/commands/fit_command.hpp"
#include "firmware_like/process/complaint.hpp"
#include "hal/small_disk.hpp"
#include "host_sim/scripted_run.hpp"

#include <doctest/doctest.h>

#include <span>
#include <string_view>

using namespace moldloft;
using namespace moldloft::host_sim;
using namespace std::chrono_literals;
using tasks::CellState;
using tasks::HoldCause;

namespace {

int surface_shots(const SimulatedCell& cell) {
  return cell.controller.cell().shots_taken(hal::ShotPurpose::surface);
}
int boundary_shots(const SimulatedCell& cell) {
  return cell.controller.cell().shots_taken(hal::ShotPurpose::boundary);
}

// Half-way through a frame: the controller knows by then that it was exposed, and lets the arm go.
bool computes(const SimulatedCell& cell, hal::Instant now) {
  auto& scanner = cell.world.scanner();
  return now > scanner.busy_from() + 50ms && now < scanner.busy_until();
}
// Past the middle of the heights, the last but one of a frame's columns: 350 kB at 12.5 MB/s take 28 ms.
bool arrives(const SimulatedCell& cell, hal::Instant now) {
  const hal::Instant sent = cell.world.scanner().busy_until();
  return now > sent + 20ms && now < sent + 27ms;
}
bool moves(const SimulatedCell& cell, hal::Instant now) {
  return now > cell.world.robot().busy_from() && now < cell.world.robot().stands_at();
}

// Does something at the first tick at which a condition holds, and something else so much later.
class Once {
 public:
  bool begins(bool condition, hal::Instant now) {
    if (at_ >= 0ns || !condition) return false;
    at_ = now;
    return true;
  }
  bool is_over(hal::Duration later, hal::Instant now) {
    if (at_ < 0ns || over_ || now < at_ + later) return false;
    return over_ = true;
  }
  bool happened() const { return at_ >= 0ns; }

 private:
  hal::Instant at_{-1};
  bool over_ = false;
};

std::string message(const SimulatedRun& run) { return run.summary["message"]; }
bool says(const SimulatedRun& run, std::string_view text) {
  return message(run).find(text) != std::string::npos;
}

}  // namespace

TEST_CASE(
    "scanner cable cut while it computes: the cell holds, reconnects, gets the same shot and completes") {
  ScriptedRun cell;
  Once cut;
  bool held = false;
  const auto run = cell.run([&](const SimulatedCell& c, hal::Instant now) {
    if (cut.begins(surface_shots(c) == 5 && computes(c, now), now)) c.scanner_cable.cut();
    if (cut.is_over(2s, now)) c.scanner_cable.mend();
    held = held || (c.controller.cell().state() == CellState::held &&
                    c.controller.cell().cause() == HoldCause::scanner);
  });
  CHECK(held);
  CHECK(run.exit_code == firmware_like::exit_done);
  check_truth(run.summary);
  CHECK(cell.exposures ==
        cell.shots().size());  // the scanner gave the stored frame: nothing was exposed twice
  CHECK(cell.repeats >= 1);
  CHECK(run.summary["shots"]["surface"] == 16);
}

TEST_CASE(
    "scanner cable cut while a frame arrives: what was seen of it counts for nothing, and the frame comes "
    "again") {
  for (const bool on_surface : {false, true}) {
    CAPTURE(on_surface);
    ScriptedRun cell, undisturbed;
    Once cut;
    bool looked = false;
    const auto run = cell.run([&](const SimulatedCell& c, hal::Instant now) {
      const bool there = on_surface ? surface_shots(c) == 5 : boundary_shots(c) == 5;
      if (cut.begins(there && arrives(c, now), now)) {
        looked = c.controller.surface().looking();
        c.scanner_cable.cut();
      }
      if (cut.is_over(2s, now)) c.scanner_cable.mend();
    });
    CHECK(looked);
    CHECK(cell.went_through("Held"));
    CHECK(run.exit_code == firmware_like::exit_done);
    CHECK(cell.exposures == cell.shots().size());
    CHECK(cell.repeats >= 1);
    const auto smooth = undisturbed.run();
    CHECK(run.summary["shots"] == smooth.summary["shots"]);
    CHECK(run.summary["points"] == smooth.summary["points"]);
    CHECK(cell.file("surface.json") == undisturbed.file("surface.json"));
  }
}

TEST_CASE(
    "scanner cable cut and mended while the arm moves: the cell goes on although the scanner is back before "
    "it holds") {
  for (const auto pause : {0ms, 1ms, 300ms}) {
    CAPTURE(pause.count());
    ScriptedRun cell;
    Once cut;
    const auto run = cell.run([&](const SimulatedCell& c, hal::Instant now) {
      if (cut.begins(boundary_shots(c) == 4 && moves(c, now) && !computes(c, now), now))
        c.scanner_cable.cut();
      if (cut.is_over(pause, now)) c.scanner_cable.mend();
    });
    CHECK(cut.happened());
    CHECK(cell.went_through("Holding"));
    CHECK(run.exit_code == firmware_like::exit_done);
    check_truth(run.summary);
  }
}

TEST_CASE(
    "a scanner that goes while the arm calibrates is waited for, and missed by name when it stays away") {
  ScriptedRun comes_back, stays_away;
  const auto cut_at_once = [](ScriptedRun& cell, hal::Duration pause) {
    return cell.run([cut = Once{}, pause](const SimulatedCell& c, hal::Instant now) mutable {
      if (cut.begins(c.world.robot().counters().calibrations == 1, now)) c.scanner_cable.cut();
      if (cut.is_over(pause, now)) c.scanner_cable.mend();
    });
  };
  CHECK(cut_at_once(comes_back, 5s).exit_code == firmware_like::exit_done);
  const auto refused = cut_at_once(stays_away, 2h);
  CHECK(refused.exit_code == firmware_like::exit_aborted);
  CHECK(message(refused) == "scanner: the cable is cut");
  CHECK_FALSE(std::filesystem::exists(stays_away.folder()));  // nothing was measured: nothing stays behind
}

TEST_CASE("lines that come garbled from the robot stop no run, and its timing says how many there were") {
  ScriptedRun cell;
  Once garbles;
  const auto run = cell.run([&](const SimulatedCell& c, hal::Instant now) {
    if (!garbles.begins(boundary_shots(c) == 3 && moves(c, now), now)) return;
    for (const std::string_view line : {"<0000 PNG *1\n", "\x80\xFE\n", "<0001 DON 1.0\n"})
      c.robot_cable.device().write(std::as_bytes(std::span{line}));
  });
  CHECK(garbles.happened());
  CHECK(run.exit_code == firmware_like::exit_done);
  check_truth(run.summary);
  const auto timing = firmware_like::Json::parse(cell.file("timing.json"));
  int garbled = 0, of_scanner = 0;
  for (const auto& loss : timing["losses"]) {
    if (loss["what"] == "garbled lines") garbled += loss["count"].get<int>();
    if (loss["of"] == "scanner") of_scanner += loss["count"].get<int>();
  }
  CHECK(garbled == 3);
  CHECK(of_scanner == 0);
}

TEST_CASE("scanner power cycle in mid-frame: the shot is taken again and the run completes") {
  for (const int variant : {0, 1, 2, 3}) {
    const bool on_surface = variant % 2 == 1, in_its_frame = variant >= 2;
    CAPTURE(on_surface);
    CAPTURE(in_its_frame);
    ScriptedRun cell;
    Once cycle;
    const auto run = cell.run([&](const SimulatedCell& c, hal::Instant now) {
      const bool there = on_surface ? surface_shots(c) == 3 : boundary_shots(c) == 3;
      const bool then = in_its_frame ? arrives(c, now) : computes(c, now);
      if (cycle.begins(there && then, now)) c.world.scanner().power_cycle();
    });
    CHECK(cycle.happened());
    CHECK(run.exit_code == firmware_like::exit_done);
    check_truth(run.summary);
    CHECK(run.summary["shots"]["retaken"] == 1);
    CHECK(cell.exposures == cell.shots().size() + 1);  // the lost frame's
    const hal::TemporaryFolder results;                // the replay must know that the shot was given up
    CHECK(firmware_like::fit_run({.run = cell.folder(), .out = results.path()}) == firmware_like::exit_done);
    CHECK(text_of(results.file("surface.json")) == cell.file("surface.json"));
  }
}

TEST_CASE("robot cable cut: the cell aborts, everything is stored, and the run can be resumed") {
  ScriptedRun cell;
  Once cut;
  const auto run = cell.run([&](const SimulatedCell& c, hal::Instant now) {
    if (cut.begins(surface_shots(c) == 3 && moves(c, now), now)) c.robot_cable.cut();
  });
  CHECK(run.exit_code == firmware_like::exit_aborted);
  CHECK(says(run, "cable is cut"));
  CHECK(run.summary["result"] == "aborted");
  CHECK(cell.states().back() == "Aborted");
  CHECK_FALSE(run.summary.contains("surface"));
  cell.options.resume = true;
  const auto resumed = cell.run();
  CHECK(resumed.exit_code == firmware_like::exit_done);
  check_truth(resumed.summary);
}

TEST_CASE("emergency stop in mid-motion: the cell aborts and stays so, whatever else it is told") {
  ScriptedRun cell;
  Once press;
  std::uint64_t motions_then = 0;
  const auto run = cell.run([&](const SimulatedCell& c, hal::Instant now) {
    if (press.begins(boundary_shots(c) == 6 && moves(c, now), now)) {
      c.world.robot().press_emergency_stop(now);
      motions_then = c.world.robot().counters().motions;
    }
    if (press.is_over(1ms, now)) {
      c.world.robot().release_emergency_stop();
      c.controller.cell().command(tasks::CellEvent::unhold);
      c.controller.cell().command(tasks::CellEvent::start);
    }
  });
  CHECK(run.exit_code == firmware_like::exit_aborted);
  CHECK(says(run, "emergency stop"));
  CHECK(cell.states().back() == "Aborted");
  CHECK(cell.motions == motions_then);
}

TEST_CASE("a stop in mid-motion stops the arm, and nothing moves it again") {
  ScriptedRun cell;
  Once stop;
  std::uint64_t motions_then = 0;
  const auto run = cell.run([&](const SimulatedCell& c, hal::Instant now) {
    if (!stop.begins(boundary_shots(c) == 6 && moves(c, now), now)) return;
    c.controller.cell().command(tasks::CellEvent::stop);
    motions_then = c.world.robot().counters().motions;
  });
  CHECK(run.exit_code == firmware_like::exit_stopped);
  CHECK(cell.states().back() == "Stopped");
  CHECK(cell.motions == motions_then);
}

TEST_CASE("disk full: the cell holds before the next shot, goes on when there is room, and no shot is lost") {
  ScriptedRun cell;
  std::optional<hal::SmallDisk> disk;
  Once full;
  bool held = false;
  const auto run = cell.run([&](const SimulatedCell& c, hal::Instant now) {
    if (full.begins(surface_shots(c) == 2, now)) disk.emplace(0);
    if (full.is_over(20s, now)) disk.reset();
    if (held || c.controller.cell().state() != CellState::held) return;
    held = true;
    CHECK(c.controller.cell().cause() == HoldCause::recorder);
    CHECK(c.controller.cell().why().view().find("run.db: ") != std::string::npos);
  });
  CHECK(held);
  CHECK(run.exit_code == firmware_like::exit_done);
  check_truth(run.summary);
  CHECK(run.summary["shots"]["retaken"] == 0);
}

TEST_CASE("a disk that hangs and nobody there: the run waits, says so, ends held and can be gone on with") {
  ScriptedRun cell;
  cell.set("name", "name = \"hangs\"\ndisk_wait_s = 10");
  Once hanging, held;
  bool takes = true;
  hal::Instant since{0}, ended{0};
  std::string while_waiting;
  cell.options.disk_takes = [&] { return takes; };
  const auto run = cell.run([&](const SimulatedCell& c, hal::Instant now) {
    const auto& controlled = c.controller.cell();
    if (hanging.begins(surface_shots(c) == 2, now)) takes = false;
    if (held.begins(controlled.state() == CellState::held, now)) {
      since = now;
      while_waiting = controlled.why().view();
    }
    ended = now;
  });
  CHECK(run.exit_code == firmware_like::exit_held);
  CHECK(while_waiting.ends_with("; waiting 10 s for room (ctrl-C ends the run)"));
  CHECK(message(run) == "nothing could be stored for 10 s: the disk hangs");
  CHECK(ended - since > 9s);
  CHECK(ended - since < 11s);

  takes = true;
  cell.options.resume = true;
  const auto resumed = cell.run();
  CHECK(resumed.exit_code == firmware_like::exit_done);
  check_truth(resumed.summary);
}

TEST_CASE("where somebody can command the cell a full disk is waited for as long as it takes") {
  ScriptedRun cell;
  cell.options.held = true;
  cell.set("name", "name = \"full\"\ndisk_wait_s = 1");
  std::optional<hal::SmallDisk> disk;
  Once full;
  bool told = false;
  std::string while_waiting;
  const auto run = cell.run([&](const SimulatedCell& c, hal::Instant now) {
    auto& controlled = c.controller.cell();
    if (!told && controlled.state() == CellState::held)
      return told = true, controlled.command(tasks::CellEvent::unhold);
    if (full.begins(surface_shots(c) == 2, now)) disk.emplace(0);
    if (full.is_over(6min, now)) disk.reset();
    if (controlled.cause() == HoldCause::recorder) while_waiting = controlled.why().view();
  });
  CHECK(while_waiting.ends_with("; waiting until there is room (stop ends the run)"));
  CHECK(run.exit_code == firmware_like::exit_done);
  check_truth(run.summary);
}

TEST_CASE(
    "a disk that hangs is waited for in silence for 5 s, then the cell holds and says so, and goes on by "
    "itself") {
  for (const auto hangs : {4s, 20s}) {
    CAPTURE(hangs);
    ScriptedRun cell;
    Once hanging, held;
    bool takes = true;
    hal::Instant last_shot{0};
    std::string while_waiting;
    cell.options.disk_takes = [&] { return takes; };
    const auto run = cell.run([&](const SimulatedCell& c, hal::Instant now) {
      const auto& controlled = c.controller.cell();
      if (hanging.begins(surface_shots(c) == 2, now)) takes = false;
      if (hanging.is_over(hangs, now)) takes = true;
      if (controlled.state() == CellState::held) while_waiting = controlled.why().view();
    });
    CHECK(run.exit_code == firmware_like::exit_done);
    check_truth(run.summary);
    CHECK(run.summary["shots"]["retaken"] == 0);
    CHECK(while_waiting == (hangs == 4s ? ""
                                        : "the disk does not take what is measured: too slow, or it hangs; "
                                          "waiting 600 s for room (ctrl-C ends the run)"));
  }
}

TEST_CASE("a start pose off the plate is held with the place and what to do") {
  ScriptedRun cell;
  cell.set("centre_mm", "centre_mm = [510, 400, 15]");
  const auto run = cell.run();
  CHECK(run.exit_code == firmware_like::exit_held);
  CHECK(message(run) ==
        "no plate under the scanner at x 510 y 400 mm, looked for at 2 heights: move [start] onto the plate");
  CHECK(cell.shots().size() == 2);  // the looks that found nothing can be looked at
}

TEST_CASE("a plate that leaves the workspace aborts before the arm does, and the message names the limit") {
  ScriptedRun cell;
  cell.set("y_mm", "y_mm = [-800, 50]");
  const auto run = cell.run();
  CHECK(run.exit_code == firmware_like::exit_aborted);
  CHECK(says(run, "target outside the workspace: y "));
  CHECK(says(run,
             "limit -800.0 to 50.0 mm: move the plate, or widen [robot.workspace] if the arm may go there"));
  CHECK(cell.shots().size() >= 1);
}

TEST_CASE(
    "a memory plan that is too small holds the cell with everything saved, and a larger one goes on from "
    "there") {
  struct TooSmall {
    std::string of;  // what the plan has too little of
    double width_mm;
    const char *seek, *stripes, *says;
  };
  const TooSmall plans[] = {
      {"shots of the boundary", 1300, "seek_limit_mm = 700", "max_stripes = 200", "outline not closed after"},
      {"edge points", 1400, "seek_limit_mm = 9000", "max_stripes = 100", "outline not closed after"},
      {"shots of the surface", 500, "seek_limit_mm = 9000", "max_stripes = 200",
       "more shots than are planned for"},
  };
  for (const TooSmall& plan : plans) {
    CAPTURE(plan.of);
    ScriptedRun cell;
    cell.options.cell.arm = ArmKind::gantry;
    cell.options.cell.sizes.width_mm = plan.width_mm;
    const std::string fits = cell.set("largest_mm", "largest_mm = [100, 100]");
    cell.set("max_stripes", plan.stripes);
    cell.options.config += std::string{"\n[tracking]\n"} + plan.seek + "\n";
    const auto run = cell.run();
    CHECK(run.exit_code == firmware_like::exit_held);
    CHECK(says(run, plan.says));
    CHECK(says(run, "raise [plate] largest_mm"));
    CHECK(cell.went_through("Held"));
    const std::size_t saved = cell.shots().size();
    CHECK(saved >= 10);
    const std::uint64_t exposed_before = cell.exposures;
    CHECK(exposed_before == saved);

    cell.set("largest_mm", fits);
    cell.options.resume = true;
    const auto resumed = cell.run();
    CHECK(resumed.exit_code == firmware_like::exit_done);
    check_truth(resumed.summary);
    CHECK(cell.exposures == cell.shots().size() - saved);  // nothing that was saved is taken again
    const hal::TemporaryFolder results;
    CHECK(firmware_like::fit_run({.run = cell.folder(), .out = results.path()}) == firmware_like::exit_done);
    CHECK(text_of(results.file("surface.json")) == cell.file("surface.json"));
  }
}

TEST_CASE("no scanner: the start is refused by name after the time that the configuration gives") {
  ScriptedRun cell;
  hal::Instant ended{0};
  const auto run = cell.run([&](const SimulatedCell& c, hal::Instant now) {
    if (now < 2ms) c.scanner_cable.cut();
    ended = now;
  });
  CHECK(run.exit_code == firmware_like::exit_aborted);
  CHECK(message(run) == "scanner: the cable is cut");
  CHECK(ended > 10s);
  CHECK(ended < 11s);
  CHECK(cell.motions == 0);
}
