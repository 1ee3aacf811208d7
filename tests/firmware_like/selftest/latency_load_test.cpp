// The load of the timing self-test in virtual time: it must be what it says, or a latency beside it means nothing.
#include "firmware_like/selftest/latency_load.hpp"

#include "firmware_like/config/task_table.hpp"
#include "hal/record/run_store.hpp"
#include "hal/temporary_folder.hpp"

#include <doctest/doctest.h>

using namespace moldloft;
using namespace moldloft::firmware_like;
using namespace std::chrono_literals;

namespace {

// A scanner of fewer points than the deployed one: the parts are the same, only shorter.
CellConfig small_scanner() {
  CellConfig config = default_config();
  config.scanner.max_stripes = 40;
  config.scanner.max_points_per_stripe = 120;
  return config;
}

}  // namespace

TEST_CASE("the load of the self-test measures its plate again and again, to the scanner's noise") {
  hal::VirtualClock clock;
  const CellConfig config = small_scanner();
  const auto load = std::make_unique<LatencyLoad>(config, clock);
  load->scheduler().start();
  std::uint64_t points_of_one = 0;
  while (load->surfaces() < 2 && clock.now() < 60s) {
    load->scheduler().run_tick();
    if (load->surfaces() == 1 && points_of_one == 0) points_of_one = load->points_seen();
  }
  REQUIRE_FALSE(load->failed());
  REQUIRE(load->surfaces() == 2);
  CHECK(load->points_seen() == 2 * points_of_one);  // every plate like the first
  const auto& report = load->surface().fit().report();
  CHECK(report.sigma_mm == doctest::Approx(config.scanner.noise_mm).epsilon(0.05));
  // The plate covers 300 x 300 mm of what the 16 fields of 102 x 102 mm see twice over in places.
  CHECK(points_of_one > 16u * 40 * 120 / 2);
}

TEST_CASE("there is background work in every tick of the self-test, once it has begun") {
  hal::VirtualClock clock;
  const auto load = std::make_unique<LatencyLoad>(small_scanner(), clock);
  load->scheduler().start();
  for (std::uint32_t i = 0; i <= load->scheduler().settings().warm_up_ticks; ++i)
    load->scheduler().run_tick();
  const auto before = load->scheduler().background()[0].runs;
  std::uint64_t idle_ticks = 0, runs = before;
  for (int i = 0; i < 2000; ++i) {
    load->scheduler().run_tick();
    const auto now = load->scheduler().background()[0].runs;
    if (now == runs) ++idle_ticks;
    runs = now;
  }
  CHECK(idle_ticks == 0);
}

TEST_CASE(
    "the self-test's frames come in at a link's pace, whole and undamaged, and are stored as a cell's") {
  hal::VirtualClock clock;
  const CellConfig config = small_scanner();
  const auto load = std::make_unique<LatencyLoad>(config, clock);
  const hal::TemporaryFolder folder;
  auto store = hal::RunStore::open(folder.file("run.db"), hal::RunStore::Mode::create);
  REQUIRE(store.has_value());
  load->scheduler().start();
  for (int tick = 0; tick < 1000; ++tick) {
    load->scheduler().run_tick();
    if (tick % 10 == 9) REQUIRE(load->recorder().drain(*store));
  }
  CHECK(load->frames() == 5);  // every 200 ms
  CHECK(load->frames_refused() == 0);
  CHECK(load->frames_damaged() == 0);
  CHECK(load->recorder().lost() == 0);
  const auto shots = store->shots();
  REQUIRE(shots.has_value());
  REQUIRE(shots->size() == 5);
  const auto frame = store->frame(shots->back(), hal::psc1::frame_codec);
  REQUIRE_MESSAGE(frame.has_value(), frame.error().what);
  CHECK(frame->stripe_count == 40);
  CHECK(frame->point_count == 40 * 120);
}

TEST_CASE("a recorder that nobody empties makes the self-test refuse frames and lose none") {
  hal::VirtualClock clock;
  const auto load = std::make_unique<LatencyLoad>(small_scanner(), clock);
  load->scheduler().start();
  for (int tick = 0; tick < 3000; ++tick) load->scheduler().run_tick();
  CHECK(load->frames() >= 3);
  CHECK(load->frames() <= 5);  // the rings are planned for four
  CHECK(load->frames_refused() == 15 - load->frames());
  CHECK(load->recorder().lost() == 0);
}

TEST_CASE("rows of the self-test have the budgets of the controller's table") {
  hal::VirtualClock clock;
  const auto load = std::make_unique<LatencyLoad>(small_scanner(), clock);
  const auto rows = load->scheduler().tasks();
  REQUIRE(rows.size() == 2);
  CHECK(rows[0].spec.name == task_table[0].name);
  CHECK(rows[0].spec.budget == task_table[0].budget);
  CHECK(rows[1].spec.name == task_table[2].name);
  CHECK(rows[1].spec.budget == task_table[2].budget);
}
