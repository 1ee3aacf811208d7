// The controller without devices: how each end of a run becomes an exit code, and a summary that has no
// result in it.
#include "firmware_like/controller/controller.hpp"

#include "firmware_like/controller/result_of.hpp"
#include "firmware_like/process/complaint.hpp"
#include "firmware_like/results/summary.hpp"
#include "firmware_like/results/timing_report.hpp"
#include "hal/links/cable.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <utility>

using namespace moldloft;
using namespace moldloft::firmware_like;
using namespace std::chrono_literals;

namespace {

struct Bench {
  hal::VirtualClock clock;
  hal::Cable scanner{clock, {}}, robot{clock, {}};
  std::unique_ptr<Controller> controller =
      std::make_unique<Controller>(default_config(), clock, scanner.host(), robot.host());

  void run_to_rest() {
    while (controller->tick() && clock.now() < 1min) {
    }
  }
};

}  // namespace

TEST_CASE(
    "devices that never answer: aborted after the configured time, by the name of the one that is missing") {
  Bench bench;
  bench.scanner.cut();
  bench.controller->start();
  bench.run_to_rest();
  CHECK(bench.controller->at_rest());
  CHECK(exit_code(outcome_of(*bench.controller)) == exit_aborted);
  CHECK(bench.controller->cell().why().view() == "scanner: the cable is cut");
  CHECK(bench.clock.now() > 10s);
  CHECK(bench.clock.now() < 11s);
  CHECK_FALSE(bench.controller->cell().has_driven());
}

TEST_CASE("a stop before the devices are there ends at once") {
  Bench bench;
  bench.controller->start();
  for (int i = 0; i < 10; ++i) bench.controller->tick();
  CHECK_FALSE(bench.controller->at_rest());
  bench.controller->cell().command(tasks::CellEvent::stop);
  bench.run_to_rest();
  CHECK(exit_code(outcome_of(*bench.controller)) == exit_stopped);
  CHECK(bench.clock.now() < 1s);
}

TEST_CASE("the summary of a run without result says so and promises none") {
  Bench bench;
  bench.controller->start();
  bench.controller->cell().command(tasks::CellEvent::stop);
  bench.run_to_rest();
  const RunResult result = result_of(*bench.controller, {.plate = "panel", .seed = {}});
  const Json s = summary_json(result);
  CHECK(s["result"] == "stopped");
  CHECK(s["plate"] == "panel");
  CHECK(s["seed"].is_null());
  CHECK(s["points"]["total"] == 0);
  CHECK_FALSE(s.contains("surface"));
  CHECK_FALSE(s.contains("boundary"));
  CHECK(s["memory"]["plan_bytes"].get<std::size_t>() == total_plan(bench.controller->memory()));
}

TEST_CASE("the timing report names every row of the task table") {
  Bench bench;
  bench.controller->start();
  for (int i = 0; i < 300; ++i) bench.controller->tick();
  const Json t = result_of(*bench.controller, {}).timing;
  std::vector<std::string> names;
  for (const auto& task : t["tasks"]) names.push_back(task["name"]);
  CHECK(names ==
        std::vector<std::string>{"scanner in", "robot in", "cell", "robot out", "scanner out", "health"});
  CHECK(t["ticks"] == 300);
  CHECK(t["missed_ticks"] == 0);
  CHECK(t["tick_us"] == 1000.0);
  CHECK(t["tasks"][0]["runs"] == 290);  // without the ten of the warm-up
  CHECK(t["background"][0]["name"] == "surface");
  CHECK(t["representative"] == false);
  CHECK(t["why"] == "virtual time");
}

namespace {

// Virtual time that oversleeps once, by so much.
class StallingClock final : public hal::Clock {
 public:
  hal::Instant now() noexcept override { return now_; }
  void sleep_until(hal::Instant wake) noexcept override {
    now_ = std::max(now_, wake) + std::exchange(stall, hal::Duration{0});
  }
  hal::Duration stall{0};

 private:
  hal::Instant now_{0};
};

}  // namespace

TEST_CASE(
    "a missed tick aborts the cell where the configuration says so, and freezes the flight recorder either "
    "way") {
  for (const bool stop : {false, true}) {
    CAPTURE(stop);
    StallingClock clock;
    hal::Cable scanner{clock, {}}, robot{clock, {}};
    auto config = default_config();
    if (stop) config.missed_ticks = tasks::MissedTickPolicy::stop;
    const auto controller = std::make_unique<Controller>(config, clock, scanner.host(), robot.host());
    controller->start();
    for (int i = 0; i < 20; ++i) REQUIRE(controller->tick());
    CHECK_FALSE(controller->flight().due());
    clock.stall = 3500us;
    controller->tick();
    CHECK(controller->scheduler().missed_ticks() == 3);
    CHECK(controller->flight().due());
    for (int i = 0; i < 25 && controller->tick(); ++i) {
    }
    if (!stop) {
      CHECK(controller->flight().frozen());
      CHECK(controller->cell().state() == tasks::CellState::starting);
    } else {
      CHECK(exit_code(outcome_of(*controller)) == exit_aborted);
      CHECK(controller->cell().why().view() ==
            "3 ticks missed at 0.024 s, woken late (none), and missed_ticks is \"stop\": clear when the cell "
            "is safe");
    }
  }
}
