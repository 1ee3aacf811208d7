// One run of the whole cell in one thread under virtual time: the controller that is deployed, on simulated cables,
// against the simulated world. A pure function of the description: the same seed gives the same bytes.
//
// Blocking     writes the run folder; otherwise only computes
// Failure      one line; a run that does not complete is no failure of the simulation: its summary says what happened
#pragma once

#include <expected>
#include <filesystem>
#include <functional>
#include <optional>

#include "firmware_like/results.hpp"
#include "host_sim/judge.hpp"
#include "host_sim/world.hpp"

namespace moldloft::host_sim {

struct SimulatedRunOptions {
  CellDescription cell;
  std::filesystem::path out;
  bool write_everything = true;  // false: run.db and no other file; for campaigns that look at the summary only
  bool real_time = false;        // paced by the wall clock instead of as fast as it goes
  std::function<void(const tasks::CellProgress&)> on_progress;  // now and then, for a terminal
  hal::Duration time_limit = std::chrono::hours{2};  // of cell time: a run that never rests is a defect, and ends here
};

struct SimulatedRun {
  firmware_like::Json summary;  // with `truth` when the run completed
  int exit_code = 0;
};

std::expected<SimulatedRun, SimError> simulate(const SimulatedRunOptions&);

}  // namespace moldloft::host_sim
