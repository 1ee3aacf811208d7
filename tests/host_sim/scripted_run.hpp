// A whole-cell run under virtual time in a folder of its own, watched from the first tick to the last:
// whatever a test does to the cell, no motion is executed twice, the arm stays inside its limits, no accepted
// shot and no record is lost.
#pragma once

#include "firmware_like/config/device_makes.hpp"
#include "hal/record/run_store.hpp"
#include "hal/temporary_folder.hpp"
#include "host_sim/cell/cell_config.hpp"
#include "host_sim/child_process.hpp"
#include "host_sim/runs/simulated_run.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <functional>
#include <set>
#include <sstream>

namespace moldloft::host_sim {

using firmware_like::Json;

class ScriptedRun {
 public:
  using Script = std::function<void(const SimulatedCell&, hal::Instant)>;

  ScriptedRun() { options.out = folder_.file("run"); }

  SimulatedRunOptions options;

  // The configuration that fits the cell, with one line replaced; the line is told by its beginning. Returns
  // what stood there.
  std::string set(const std::string& begins, const std::string& line) {
    std::istringstream lines{config()};
    std::string text, before;
    bool found = false;
    for (std::string old; std::getline(lines, old);) {
      const bool is_it = old.starts_with(begins);
      found = found || is_it;
      if (is_it) before = old;
      text += (is_it ? line : old) + "\n";
    }
    REQUIRE(found);
    options.config = text;
    return before;
  }

  SimulatedRun run(const Script& script = {}) {
    const auto limits = firmware_like::parse_config(config(), "cell.toml")->robot.workspace;
    options.on_tick = [&](const SimulatedCell& cell, hal::Instant now) {
      if (script) script(cell, now);
      watch(cell, now, limits);
    };
    const auto done = simulate(options);
    REQUIRE_MESSAGE(done.has_value(), done.error().what);
    CHECK(most_executions <= 1);
    CHECK(left_the_limits == 0);
    CHECK(done->summary["recorder_lost"] == 0);
    if (std::filesystem::exists(options.out / "run.db")) check_store(done->summary);
    return *done;
  }

  std::string folder() const { return options.out; }
  std::string file(const std::string& name) const { return text_of(options.out / name); }
  std::vector<hal::ShotRecord> shots() const { return *store().shots(); }
  std::vector<std::string> states() const {  // of the cell, in order
    const auto events = store().events();
    std::vector<std::string> all;
    for (const auto& e : *events) {
      if (e.source.view() == "cell" && e.from.view() != e.to.view()) all.emplace_back(e.to.view());
    }
    return all;
  }
  bool went_through(const std::string& state) const {
    const auto all = states();
    return std::find(all.begin(), all.end(), state) != all.end();
  }

  // Seen from the world's side, at the last tick.
  std::uint32_t most_executions = 0;
  std::uint64_t motions = 0, exposures = 0, repeats = 0;

 private:
  std::string config() const {
    return options.config.empty() ? cell_toml(options.cell, *placed_plate(options.cell)) : options.config;
  }
  hal::RunStore store() const {
    return std::move(*hal::RunStore::open(options.out / "run.db", hal::RunStore::Mode::read));
  }

  void watch(const SimulatedCell& cell, hal::Instant now, const tasks::Workspace& limits) {
    most_executions = std::max(most_executions, cell.world.robot().counters().most_executions);
    motions = cell.world.robot().counters().motions;
    exposures = cell.world.scanner().counters().exposures;
    repeats = cell.world.scanner().counters().repeats;
    // On its way from one pose to the next the arm's tip may leave a box that both ends lie in, so places where it has
    // been sent are looked at, where it stands.
    if (now < cell.world.robot().busy_until()) return;
    if (cell.world.robot().counters().motions == 0) return;
    const Eigen::Vector3d tip = cell.world.world_from_tip(now).translation();
    constexpr double arm_error_mm = 0.5;
    const auto off = [&](double v, const tasks::Range& r) {
      return v < r.min - arm_error_mm || v > r.max + arm_error_mm;
    };
    if (off(tip.x(), limits.x_mm) || off(tip.y(), limits.y_mm) || off(tip.z(), limits.z_mm) ||
        off(tip.head<2>().norm(), limits.reach_mm)) {
      ++left_the_limits;
    }
  }

  // Every shot that the cell has counted is in the store, whole, once.
  void check_store(const Json& summary) const {
    const auto records = shots();
    std::set<std::uint32_t> numbers;
    const auto opened = store();
    for (const auto& shot : records) {
      numbers.insert(tasks::shot_number_of(shot.shot_id));
      CHECK(opened.frame(shot, **firmware_like::frame_codec_of(opened)).has_value());
    }
    CHECK(numbers.size() == records.size());
    const auto counted = [&](const char* purpose) { return summary["shots"][purpose].get<std::size_t>(); };
    CHECK(records.size() == counted("seek") + counted("boundary") + counted("surface"));
  }

  hal::TemporaryFolder folder_;
  int left_the_limits = 0;
};

inline void check_truth(const Json& summary) {
  REQUIRE(summary.contains("truth"));
  CHECK(summary["truth"]["normal_rms_mm"].get<double>() <= 0.02);
  CHECK(summary["truth"]["normal_max_mm"].get<double>() <= 0.08);
  CHECK(summary["truth"]["outline_max_mm"].get<double>() <= 0.3);
  CHECK(summary["truth"]["corner_max_mm"].get<double>() <= 0.3);
}

}  // namespace moldloft::host_sim
