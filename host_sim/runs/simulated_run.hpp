// One run of the whole cell in one thread under virtual time: the controller that is deployed, on
// simulated cables, against the simulated world. A pure function of the description: the same seed gives
// the same bytes.
//
// Blocking     writes the run folder; otherwise only computes
// Failure      one line; a run that does not complete is no failure of the simulation: its summary says what happened
#pragma once

#include "firmware_like/controller/controller.hpp"
#include "firmware_like/process/json_text.hpp"
#include "firmware_like/results/run_result.hpp"
#include "hal/links/cable.hpp"
#include "host_sim/cell/world.hpp"
#include "host_sim/runs/judge.hpp"

#include <expected>
#include <filesystem>
#include <functional>
#include <optional>

namespace moldloft::host_sim {

// What a scripted run may lay its hands on between two ticks: the devices behind their cables, the cables
// themselves, and the controller, to look at or to command.
struct SimulatedCell {
  SimulatedWorld& world;
  hal::Cable& scanner_cable;
  hal::Cable& robot_cable;
  firmware_like::Controller& controller;
  hal::RunStore& store;
};

struct SimulatedRunOptions {
  CellDescription cell;
  std::filesystem::path out;           // empty: a new folder under out/
  std::string config;                  // the controller's cell.toml; empty: the one that fits the cell
  std::string name = {}, remark = {};  // of the plate; empty: its shape and seed, nothing
  bool resume = false;                 // goes on with the run in `out`
  bool held = false;                   // comes up held, and waits for what on_tick commands
  bool write_everything =
      true;                // false: run.db and no other file; for campaigns that look at the summary only
  bool real_time = false;  // paced by the wall clock instead of as fast as it goes
  std::function<void(const PlateInstance&)> on_plate;               // once, before the run is begun
  std::function<void(const tasks::CellProgress&)> on_progress;      // now and then, for a terminal
  std::function<void(const SimulatedCell&, hal::Instant)> on_tick;  // after every tick: faults come from here
  std::function<bool()> disk_takes;  // false: nothing reaches the disk for now; empty: it always does
  hal::Duration time_limit =
      std::chrono::hours{2};  // of cell time: a run that never rests is a defect, and ends here
};

struct SimulatedRun {
  firmware_like::RunResult result;   // with `truth` when the run completed
  firmware_like::Json summary = {};  // the same as summary.json has it
  int exit_code = 0;
  std::filesystem::path folder = {};  // where it is
};

std::expected<SimulatedRun, SimError> simulate(const SimulatedRunOptions&);

}  // namespace moldloft::host_sim
