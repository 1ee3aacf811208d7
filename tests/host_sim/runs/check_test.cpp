// `moldloft check`: all that is wrong at once, and the devices asked without a motion.
#include "firmware_like/controller/device_check.hpp"
#include "firmware_like/process/complaint.hpp"
#include "hal/links/cable.hpp"
#include "host_sim/cell/cell_config.hpp"
#include "host_sim/cell/world.hpp"
#include "host_sim/cell/world_clock.hpp"
#include "host_sim/child_process.hpp"

#include <doctest/doctest.h>

#include <csignal>
#include <filesystem>
#include <fstream>

using namespace moldloft;
using namespace moldloft::host_sim;
using namespace std::chrono_literals;

namespace {

// The devices behind cables in virtual time, and the configuration that fits them.
struct Bench {
  WorldClock clock;
  hal::Cable scanner{clock, {}}, robot{clock, {.bytes_per_second = serial_bytes_per_second}};
  CellDescription cell;
  SimulatedWorld world{cell, *placed_plate(cell), scanner.device(), robot.device()};
  firmware_like::CellConfig config =
      firmware_like::parse_config(cell_toml(cell, *placed_plate(cell)), "cell.toml").value();

  Bench() { clock.carry(world); }
  firmware_like::DeviceReports asked() {
    return firmware_like::try_devices(config, clock, scanner.host(), robot.host(), 77);
  }
};

bool holds(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

}  // namespace

TEST_CASE("asked by the check, both devices answer, the scanner exposes once and the arm does not move") {
  Bench bench;
  const Eigen::Vector3d before = bench.world.world_from_tip(bench.clock.now()).translation();
  const auto reports = bench.asked();
  CHECK(reports.scanner.ok);
  CHECK(holds(reports.scanner.text, "field 102 x 102 mm, depth +-60 mm; one exposure: "));
  CHECK(reports.scanner.warnings.empty());
  CHECK(reports.robot.ok);
  CHECK(
      holds(reports.robot.text, "synchronised, not calibrated (a run does that first); the tip stands at "));
  CHECK(bench.world.scanner().counters().exposures == 1);
  CHECK(bench.world.robot().counters().motions == 0);
  for (int i = 0; i < 5000; ++i) bench.clock.sleep_until(bench.clock.now() + 1ms);
  CHECK(bench.world.robot().counters().motions == 0);
  CHECK(bench.world.world_from_tip(bench.clock.now()).translation() == before);
}

TEST_CASE("a scanner that has another field or depth than the configuration says is told") {
  Bench bench;
  bench.config.scanner.field_y_mm = 80;
  bench.config.scanner.depth_mm = 90;
  const auto reports = bench.asked();
  REQUIRE(reports.scanner.warnings.size() == 2);
  CHECK(reports.scanner.warnings[0] ==
        "[scanner] field_mm: 80 in the configuration, 102 by the scanner's word");
  CHECK(reports.scanner.warnings[1] ==
        "[scanner] depth_mm: 90 in the configuration, 60 by the scanner's word");
}

TEST_CASE("devices that are not there are both told, after the configured time") {
  Bench bench;
  bench.scanner.cut();
  bench.robot.cut();
  const auto reports = bench.asked();
  CHECK_FALSE(reports.scanner.ok);
  CHECK_FALSE(reports.robot.ok);
  CHECK(holds(reports.scanner.text, "the cable is cut"));
  CHECK(holds(reports.robot.text, "the cable is cut"));
  CHECK(bench.clock.now() >= 10s);
  CHECK(bench.clock.now() < 11s);
}

TEST_CASE("check tells all errors and all that the machine lacks, and ends with 1") {
  const hal::TemporaryFolder folder;
  const std::string config = folder.file("cell.toml"), none = folder.file("none");
  std::ofstream{config} << "[robot]\nbaud = 9\ndevice = \"" << none
                        << "\"\n[scanner]\nhost = \"no.such.host\"\nport = 0\n[fit]\ntolerance_mm = 1\n";
  const auto check = run_program({MOLDLOFT, "check", config});
  CHECK(check.exit_code == firmware_like::exit_failed);
  CHECK(check.err == config + ":2: [robot] baud: 9 is outside 1200 to 921600\n" + config +
                         ":6: [scanner] port: 0 is outside 1 to 65535\n" + config +
                         ":8: warning: [fit] tolerance_mm: 1 is more than [scanner] noise_mm, 0.051; the "
                         "surface would be coarser "
                         "than a single point\n" +
                         config +
                         ":5: [scanner] host: 'no.such.host' is neither an address nor a name in /etc/hosts; "
                         "write the address in "
                         "numbers\n" +
                         config + ":3: [robot] device: " + none +
                         " does not exist; is the robot's cable plugged in, is the name right?\n" + config +
                         ": 4 errors, 1 warning\n");
  CHECK(check.out == "");
}

TEST_CASE(
    "check of a good file prints the memory plan, the limits and the set-up, and warnings leave it good") {
  const hal::TemporaryFolder folder;
  const std::string config = folder.file("cell.toml");
  // Any character device is a port as long as it is not opened.
  std::ofstream{config}
      << "[robot]\ndevice = \"/dev/null\"\nbaud = 115000\n[realtime]\nheap_reserve_mib = 1\n";
  const auto check = run_program({MOLDLOFT, "check", config});
  CHECK(check.exit_code == firmware_like::exit_done);
  CHECK(check.err.starts_with(config + ":3: warning: [robot] baud: 115000 is no usual rate"));
  CHECK(lines_in(check.err) == 1);
  for (const char* part : {"memory plan\n", "  recorder rings", "  in all", "limits\n  tip x",
                           "-800 to 800 mm", "tip at 500.0 140.0 310.0 mm", "real-time set-up\n",
                           "memory lock", "heap reserve", "timing figures"}) {
    CAPTURE(part);
    CHECK(holds(check.out, part));
  }
  CHECK(check.out.ends_with(config + ": good, 1 warning\n"));
}

TEST_CASE("check on what is no file, and a file that is only its defaults") {
  const hal::TemporaryFolder folder;
  const auto directory = run_program({MOLDLOFT, "check", folder.path().string()});
  CHECK(directory.exit_code == firmware_like::exit_failed);
  CHECK(directory.err ==
        "moldloft: " + folder.path().string() + ": is a directory; give the path of a cell configuration\n");
  std::ofstream{folder.file("empty.toml")} << "";
  const auto empty = run_program({MOLDLOFT, "check", folder.file("empty.toml")});
  CHECK(holds(empty.out, "largest plate         500 x 500 mm"));
}

TEST_CASE("check --connect on the real links names both missing devices, and moves nothing where they are") {
  const hal::TemporaryFolder folder;
  const std::string config = folder.file("cell.toml");
  ChildProcess devices{{MOLDLOFT_SIM, "devices", "--scanner-port", "0", "--robot-pty", folder.file("robot"),
                        "--cell", config, "--log"}};
  REQUIRE_MESSAGE(devices.prints("ready:", 20s), devices.err());
  ChildProcess good{{MOLDLOFT, "check", config, "--connect"}, PTY_MODEM};
  CHECK(good.wait(60s) == firmware_like::exit_done);
  CHECK(holds(good.out(), "devices\n  scanner               "));
  CHECK(holds(good.out(), "  robot                 synchronised, not calibrated"));
  devices.send(SIGINT);
  CHECK(devices.wait(20s) == 0);
  CHECK(holds(devices.out(), "ended: 0 motions, 1 exposures"));

  std::ofstream{config}
      << "[cell]\ndevice_timeout_s = 0.5\n[scanner]\nport = 3\n[robot]\ndevice = \"/dev/null\"\n";
  ChildProcess missing{{MOLDLOFT, "check", config, "--connect"}, PTY_MODEM};
  CHECK(missing.wait(60s) == firmware_like::exit_failed);
  CHECK(holds(missing.err(), "scanner (127.0.0.1:3): 127.0.0.1:3: Connection refused"));
  CHECK(holds(missing.err(), config + ":6: robot (/dev/null): "));
  CHECK(missing.err().ends_with(config + ": 2 errors, 0 warnings\n"));
}
