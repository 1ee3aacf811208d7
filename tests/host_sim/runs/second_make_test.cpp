// A scanner of another make, from hal/README.md's recipe: a codec, a driver and a row in the table, and everything that
// works with runs works with its runs.
#include "firmware_like/commands/fit_command.hpp"
#include "firmware_like/commands/replay_command.hpp"
#include "firmware_like/commands/report_command.hpp"
#include "firmware_like/config/device_makes.hpp"
#include "firmware_like/process/complaint.hpp"
#include "firmware_like/run/run_folder.hpp"
#include "hal/triplet/triplet_scanner.hpp"
#include "host_sim/scripted_run.hpp"
#include "host_sim/triplet_server.hpp"

#include <doctest/doctest.h>

using namespace moldloft;
using namespace moldloft::host_sim;
using namespace std::chrono_literals;

namespace {

std::size_t stripes_of(const firmware_like::ScannerConfig& c) {
  return static_cast<std::size_t>(c.max_stripes);
}
std::size_t points_of(const firmware_like::ScannerConfig& c) {
  return stripes_of(c) * static_cast<std::size_t>(c.max_points_per_stripe);
}

std::unique_ptr<hal::Scanner> driver(const firmware_like::ScannerConfig& c, hal::ByteLink& link) {
  return std::make_unique<triplet::TripletScanner>(link, stripes_of(c), points_of(c));
}
std::size_t largest_frame(const firmware_like::ScannerConfig& c) {
  return triplet::largest_scan(stripes_of(c), points_of(c));
}

void use_the_second_make(ScriptedRun& cell) {
  firmware_like::add_scanner_make({"triplet", &triplet::codec, largest_frame, driver});
  cell.options.cell.scanner_driver = "triplet";
  cell.options.cell.make_scanner = [](hal::ByteLink& link, Optics optics, const Scene& scene,
                                      const ScannerTimes& times,
                                      std::uint64_t seed) -> std::unique_ptr<ScannerDevice> {
    return std::make_unique<TripletServer>(link, std::move(optics), scene, times, seed);
  };
}

}  // namespace

TEST_CASE("a whole cell runs with a scanner of another make, and its run is fitted, reported and replayed") {
  ScriptedRun cell;
  use_the_second_make(cell);
  const auto run = cell.run();
  CHECK(run.exit_code == firmware_like::exit_done);
  check_truth(run.summary);
  CHECK(run.summary["shots"]["retaken"] == 0);
  CHECK(hal::RunStore::open(cell.folder() + "/run.db", hal::RunStore::Mode::read)->meta("frames").value() ==
        "triplet");
  const hal::TemporaryFolder again;
  REQUIRE(firmware_like::fit_run({.run = cell.folder(), .out = again.file("fit")}) ==
          firmware_like::exit_done);
  CHECK(text_of(again.file("fit/surface.json")) == cell.file("surface.json"));
  CHECK(text_of(again.file("fit/points.ply")) == cell.file("points.ply"));
  CHECK(firmware_like::report_run({.run = cell.folder()}) == firmware_like::exit_done);
  CHECK(firmware_like::replay_run({.run = cell.folder()}) == firmware_like::exit_done);
}

TEST_CASE("the second make's scanner loses its power while the plate is measured, and comes back") {
  ScriptedRun cell;
  use_the_second_make(cell);
  bool cut = false;
  const auto run = cell.run([&](const SimulatedCell& c, hal::Instant now) {
    const bool computing = now > c.world.scanner().busy_from() + 50ms && now < c.world.scanner().busy_until();
    if (!cut && now > 8s && computing) {
      cut = true;
      c.world.scanner().power_cycle();
    }
  });
  REQUIRE(cut);
  CHECK(run.exit_code == firmware_like::exit_done);
  check_truth(run.summary);
}

TEST_CASE("a run of the second make that was stopped goes on with its stored shots") {
  ScriptedRun cell;
  use_the_second_make(cell);
  const auto stopped = cell.run([&](const SimulatedCell& c, hal::Instant now) {
    if (now > 8s) c.controller.cell().command(tasks::CellEvent::stop);
  });
  REQUIRE(stopped.exit_code == firmware_like::exit_stopped);
  const std::size_t before = cell.shots().size();
  REQUIRE(before > 5);
  cell.options.resume = true;
  const auto resumed = cell.run();
  CHECK(resumed.exit_code == firmware_like::exit_done);
  CHECK(cell.exposures <= cell.shots().size() - before + 1);  // stored shots are not taken again
  check_truth(resumed.summary);
}

TEST_CASE("a make with one encoding of its frames has no key for it") {
  firmware_like::add_scanner_make({"triplet", &triplet::codec, largest_frame, driver});
  const auto plain = firmware_like::parse_config("[scanner]\ndriver = \"triplet\"\n", "cell.toml");
  REQUIRE(plain.has_value());
  CHECK(plain->scanner.encoding.empty());
  const auto chosen =
      firmware_like::parse_config("[scanner]\ndriver = \"triplet\"\nencoding = \"float32\"\n", "cell.toml");
  REQUIRE_FALSE(chosen.has_value());
  CHECK(chosen.error().what.starts_with("cell.toml:3: [scanner] encoding: unknown key; known here: "));
}

TEST_CASE("a run whose make is not known to the program is refused by its name") {
  const hal::TemporaryFolder folder;
  {
    auto store = hal::RunStore::open(folder.file("run.db"), hal::RunStore::Mode::create);
    REQUIRE(store.has_value());
    REQUIRE(store->set_meta("config", "").has_value());
    REQUIRE(store->set_meta("frames", "lidar9").has_value());
  }
  const auto opened = firmware_like::open_run(folder.path());
  REQUIRE_FALSE(opened.has_value());
  CHECK(opened.error().what.find("of the make 'lidar9', which this program does not know") !=
        std::string::npos);
}
