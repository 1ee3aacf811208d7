// The control thread's promise for the whole controller: after start() and the first ticks, tick() touches
// the heap not once, whatever happens to the cell. What the simulated world does in its own step does not
// count, nor does the drain of the recorder, which is another thread's on a real cell.
#include "host_sim/heap_guard.hpp"

#include "firmware_like/controller/controller.hpp"
#include "firmware_like/run/run_folder.hpp"
#include "hal/links/cable.hpp"
#include "hal/scanner/psc1.hpp"
#include "hal/temporary_folder.hpp"
#include "host_sim/cell/cell_config.hpp"
#include "host_sim/cell/world.hpp"

#include <doctest/doctest.h>

#include <cstdlib>
#include <functional>
#include <memory>
#include <vector>

using namespace moldloft;
using namespace moldloft::host_sim;
using namespace std::chrono_literals;
using test::heap_calls;

namespace {

// Pages are touched, locales and lazy symbols looked up in the first ticks.
constexpr int first_ticks = 5;

class WorldClock final : public hal::VirtualClock {
 public:
  void carry(SimulatedWorld& world) { world_ = &world; }

 protected:
  void advance(hal::Instant wake) noexcept override {
    const test::HeapAllowed in_the_world;
    if (world_ != nullptr) world_->step(wake);
  }

 private:
  SimulatedWorld* world_ = nullptr;
};

struct Cell {
  explicit Cell(const CellDescription& d = {}, const std::string& folder_of_a_run = {}) : description{d} {
    const auto plate = *placed_plate(description);
    const std::string text = cell_toml(description, plate);
    auto folder = folder_of_a_run.empty()
                      ? firmware_like::create_run(own_folder.file("run"), text, hal::psc1::frame_codec,
                                                  firmware_like::RunKind::simulated)
                      : firmware_like::resume_run(folder_of_a_run, text);
    REQUIRE(folder.has_value());
    run = std::move(*folder);
    world =
        std::make_unique<SimulatedWorld>(description, plate, scanner_cable.device(), robot_cable.device());
    clock.carry(*world);
    controller = std::make_unique<firmware_like::Controller>(
        *firmware_like::parse_config(text, "cell.toml"), clock, scanner_cable.host(), robot_cable.host(),
        firmware_like::ControllerOptions{.archive = run.archive.get(), .epoch = run.archive ? 2u : 1u});
  }

  // Runs to rest with the guard on in every tick but the first; `script` runs between ticks.
  tasks::CellState run_guarded(const std::function<void(hal::Instant)>& script = {}) {
    test::forget_heap_calls();
    controller->start();
    for (int ticks = 0;; ++ticks) {
      bool goes_on = false;
      if (ticks < first_ticks) {
        goes_on = controller->tick();
      } else {
        const test::NoHeap from_here;
        goes_on = controller->tick();
      }
      if (script) script(clock.now());
      if (ticks % 10 == 0) controller->recorder().drain(*run.store);
      if (!goes_on || clock.now() > 5min) break;
    }
    controller->recorder().drain(*run.store);
    return controller->cell().state();
  }

  hal::TemporaryFolder own_folder;
  CellDescription description;
  firmware_like::RunFolder run;
  WorldClock clock;
  hal::Cable scanner_cable{clock, {}}, robot_cable{clock, {.bytes_per_second = 11520}};
  std::unique_ptr<SimulatedWorld> world;
  std::unique_ptr<firmware_like::Controller> controller;
};

int surface_shots(const Cell& cell) { return cell.controller->cell().shots_taken(hal::ShotPurpose::surface); }

}  // namespace

TEST_CASE("the guard sees every way to the heap, on its own thread and while it is on" *
          doctest::skip(!test::heap_guard_works)) {
  std::vector<int> grows;
  const auto seen = [](auto&& work) {
    test::forget_heap_calls();
    const test::NoHeap from_here;
    work();
    return heap_calls();
  };
  void* volatile memory = nullptr;
  CHECK(seen([] {}) == 0);
  CHECK(seen([&] { memory = std::malloc(10); }) == 1);
  CHECK(seen([&] { memory = std::realloc(memory, 10'000); }) >= 1);
  CHECK(seen([&] { std::free(memory); }) == 1);
  CHECK(seen([&] {
          memory = std::calloc(3, 4);
          std::free(memory);
        }) == 2);
  CHECK(seen([&] {
          memory = std::aligned_alloc(64, 128);
          std::free(memory);
        }) == 2);
  CHECK(seen([] { delete new (std::align_val_t{64}) int{1}; }) >= 1);
  CHECK(seen([&] { grows.resize(1000); }) >= 1);
  CHECK(seen([&] {
          const test::HeapAllowed here;
          grows.resize(10'000);
        }) == 0);
  CHECK(seen([] {}) == 0);
}

TEST_CASE("a complete run touches the heap in no tick after the first" *
          doctest::skip(!test::heap_guard_works)) {
  Cell cell;
  CHECK(cell.run_guarded() == tasks::CellState::complete);
  CHECK(heap_calls() == 0);
  CHECK(surface_shots(cell) == 16);
}

TEST_CASE("nor does a run with a curved plate of another outline under the gantry" *
          doctest::skip(!test::heap_guard_works)) {
  CellDescription d;
  d.plate = "wave";
  d.outline = OutlineKind::trapezoid;
  d.arm = ArmKind::gantry;
  d.seed = 3;
  Cell cell{d};
  CHECK(cell.run_guarded() == tasks::CellState::complete);
  CHECK(heap_calls() == 0);
}

TEST_CASE("nor do a lost link, a restarted scanner and a store that stands still" *
          doctest::skip(!test::heap_guard_works)) {
  Cell cell;
  int step = 0;
  hal::Instant at{0};
  const auto after = [&](int shots, hal::Instant now) {
    if (surface_shots(cell) < shots || now < at) return false;
    ++step;
    at = now + 1s;
    return true;
  };
  CHECK(cell.run_guarded([&](hal::Instant now) {
    if (step == 0 && after(2, now)) cell.scanner_cable.cut();
    if (step == 1 && after(2, now)) cell.scanner_cable.mend();
    if (step == 2 && after(6, now)) cell.world->scanner().power_cycle();
    if (step == 3 && after(8, now)) cell.controller->cell().command(tasks::CellEvent::hold);
  }) == tasks::CellState::held);
  CHECK(step == 4);
  CHECK(heap_calls() == 0);
}

TEST_CASE("nor do an emergency stop and the loss of the robot" * doctest::skip(!test::heap_guard_works)) {
  for (const bool stop : {true, false}) {
    Cell cell;
    CHECK(cell.run_guarded([&](hal::Instant now) {
      if (surface_shots(cell) != 1) return;
      if (stop) cell.world->robot().press_emergency_stop(now);
      if (!stop) cell.robot_cable.cut();
    }) == tasks::CellState::aborted);
    CHECK(heap_calls() == 0);
  }
}

TEST_CASE("nor does a resumed run, which begins with the shots of its archive" *
          doctest::skip(!test::heap_guard_works)) {
  Cell first;
  CHECK(first.run_guarded([&](hal::Instant) {
    if (surface_shots(first) == 5) first.controller->cell().command(tasks::CellEvent::stop);
  }) == tasks::CellState::stopped);
  const std::string folder = first.run.path;
  first.run = {};  // the folder is another's now
  Cell second{{}, folder};
  CHECK(second.run_guarded() == tasks::CellState::complete);
  CHECK(heap_calls() == 0);
  CHECK(second.world->scanner().counters().exposures < 16);
}
