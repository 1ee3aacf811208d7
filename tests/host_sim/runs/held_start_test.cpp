// A program that the service manager has started again: nothing reaches the robot before an operator says so.
#include "firmware_like/process/complaint.hpp"
#include "host_sim/scripted_run.hpp"

#include <doctest/doctest.h>

using namespace moldloft;
using namespace moldloft::host_sim;
using namespace std::chrono_literals;
using tasks::CellEvent;
using tasks::CellState;

namespace {

constexpr auto operator_comes = 30s;  // longer than every time-out of cell and drivers

// What the robot has been sent until the operator comes, and whether the cell has come to rest by itself.
struct Waiting {
  std::uint64_t lines = 0, motions = 0, exposures = 0;
  bool was_held = false, unheld = false, connected = false;

  void look(const SimulatedCell& c, hal::Instant now) {
    if (unheld) return;
    lines = c.world.robot().counters().lines + c.world.robot().counters().refused;
    connected = connected || c.robot_cable.device().state() == hal::LinkState::open;
    motions = c.world.robot().counters().motions;
    exposures = c.world.scanner().counters().exposures;
    was_held = c.controller.cell().state() == CellState::held;
    if (now < operator_comes) return;
    c.controller.cell().command(CellEvent::unhold);
    unheld = true;
  }
};

void check_untouched(const Waiting& waiting) {
  CHECK(waiting.unheld);
  CHECK(waiting.was_held);
  CHECK(waiting.lines == 0);  // no motion, no calibration, not even a question
  CHECK_FALSE(waiting.connected);
  CHECK(waiting.motions == 0);
  CHECK(waiting.exposures == 0);
}

}  // namespace

TEST_CASE("a run that begins held sends the robot nothing until it is unheld, then measures the plate") {
  ScriptedRun cell;
  cell.options.held = true;
  Waiting waiting;
  const auto run = cell.run([&](const SimulatedCell& c, hal::Instant now) { waiting.look(c, now); });
  check_untouched(waiting);
  CHECK(run.exit_code == firmware_like::exit_done);
  check_truth(run.summary);
  const auto states = cell.states();
  CHECK(std::vector<std::string>{states.begin(), states.begin() + 3} ==
        std::vector<std::string>{"Held", "Starting", "Execute"});
  CHECK(run.summary["cycle"]["seconds"].get<double>() <
        25);  // the wait for the operator is not the cell's time
}

TEST_CASE(
    "a run that was cut off resumes held: the robot hears nothing until it is unheld, no shot is taken "
    "twice") {
  ScriptedRun cell;
  const auto stopped = cell.run([&](const SimulatedCell& c, hal::Instant) {
    if (c.controller.cell().shots_taken(hal::ShotPurpose::surface) == 3)
      c.controller.cell().command(CellEvent::stop);
  });
  CHECK(stopped.exit_code == firmware_like::exit_stopped);
  const std::uint64_t before = cell.exposures;

  cell.options.resume = cell.options.held = true;
  Waiting waiting;
  const auto run = cell.run([&](const SimulatedCell& c, hal::Instant now) { waiting.look(c, now); });
  check_untouched(waiting);
  CHECK(run.exit_code == firmware_like::exit_done);
  check_truth(run.summary);
  CHECK(cell.exposures <= 16 + 16 - before + 1);
}

TEST_CASE("commands other than unhold do not make a cell move that was started held") {
  for (const auto command :
       {CellEvent::start, CellEvent::start_held, CellEvent::hold, CellEvent::clear, CellEvent::reset}) {
    ScriptedRun cell;
    cell.options.held = true;
    cell.options.time_limit = 2min;
    Waiting waiting;
    const auto run = cell.run([&](const SimulatedCell& c, hal::Instant now) {
      if (now >= operator_comes && !waiting.unheld) {
        waiting.unheld = true;
        c.controller.cell().command(CellEvent::stop);
        return;
      }
      if (now > 1s) c.controller.cell().command(command);
      waiting.look(c, now);
    });
    check_untouched(waiting);
    CHECK(cell.motions == 0);
    CHECK(run.exit_code == firmware_like::exit_stopped);  // although the other command came in every tick too
  }
}

TEST_CASE(
    "with an operator there, a hold and an abort wait for him, and the run goes on or ends as he says") {
  ScriptedRun cell;
  cell.options.held = true;
  int step = 0;
  hal::Instant since{0};
  const auto run = cell.run([&](const SimulatedCell& c, hal::Instant now) {
    const auto state = c.controller.cell().state();
    const auto next = [&](bool due, CellEvent command) {
      if (!due) return;
      c.controller.cell().command(command);
      ++step;
      since = now;
    };
    const auto shots = c.controller.cell().shots_taken(hal::ShotPurpose::surface);
    if (step == 0) return next(state == CellState::held, CellEvent::unhold);
    if (step == 1) return next(shots == 2, CellEvent::hold);
    if (step == 2) return next(state == CellState::held && now > since + 20s, CellEvent::unhold);
    if (step == 3) return next(shots == 4, CellEvent::abort);
    if (step == 4) return next(state == CellState::aborted && now > since + 20s, CellEvent::clear);
  });
  CHECK(step == 5);
  CHECK(run.exit_code == firmware_like::exit_stopped);
  CHECK(cell.states().back() == "Stopped");
  CHECK(cell.went_through("Unholding"));
}

TEST_CASE(
    "a stop ends a cell that waits for a person, and nobody can be awaited longer by one that has aborted") {
  for (const bool abort : {false, true}) {
    ScriptedRun cell;
    cell.options.held = true;
    cell.options.time_limit = 1min;
    hal::Instant ended{0};
    const auto run = cell.run([&](const SimulatedCell& c, hal::Instant now) {
      if (abort && now > 1s) c.controller.cell().command(CellEvent::abort);
      if (now > 10s) {
        c.controller.cell().command(CellEvent::stop);
        c.controller.dismiss_operator();
      }
      ended = now;
    });
    CHECK(run.exit_code == (abort ? firmware_like::exit_aborted : firmware_like::exit_stopped));
    CHECK(ended > 10s);
    CHECK(ended < 11s);
  }
}
