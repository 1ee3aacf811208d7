#include "hal/links/cable.hpp"
#include "hal/robot/line_robot.hpp"
#include "hal/scanner/psc_scanner.hpp"
#include "host_sim/cell/world.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <numbers>

using namespace moldloft;
using namespace moldloft::host_sim;
using namespace std::chrono_literals;

namespace {

// The controller's own drivers on one side of the cables, the simulated cell on the other.
struct Bench {
  hal::VirtualClock clock;
  hal::Cable scanner_cable{clock, {}}, robot_cable{clock, {.bytes_per_second = 11520}};
  CellDescription cell;
  SimulatedWorld world{cell, *placed_plate(cell), scanner_cable.device(), robot_cable.device()};
  hal::PscScanner scanner{scanner_cable.host(), {}};
  hal::LineRobot robot{robot_cable.host(), {}};

  Bench() {
    scanner.start(clock.now());
    robot.start(clock.now());
  }
  void tick() {
    world.step(clock.now());
    scanner.receive(clock.now());
    robot.receive(clock.now());
    scanner.transmit(clock.now());
    robot.transmit(clock.now());
    clock.sleep_until(clock.now() + 1ms);
  }
  std::optional<hal::RobotEvent> robot_says(hal::Duration within = 10s) {
    for (const auto end = clock.now() + within; clock.now() < end; tick()) {
      if (auto event = robot.next_event()) return event;
    }
    return std::nullopt;
  }
  std::optional<hal::ScannerEvent> scanner_says(hal::Duration within = 10s) {
    for (const auto end = clock.now() + within; clock.now() < end; tick()) {
      if (auto event = scanner.next_event()) return event;
    }
    return std::nullopt;
  }
  void make_ready() {
    REQUIRE(robot_says()->kind == hal::RobotEvent::Kind::ready);
    REQUIRE(robot.calibrate(clock.now()));
    REQUIRE(robot_says()->kind == hal::RobotEvent::Kind::moving);
    REQUIRE(robot_says()->kind == hal::RobotEvent::Kind::done);
    REQUIRE(scanner_says()->kind == hal::ScannerEvent::Kind::ready);
  }
};

}  // namespace

TEST_CASE("the controller's drivers bring the scanner over the plate and get a frame of it") {
  Bench bench;
  bench.make_ready();
  REQUIRE(bench.robot.move(start_pose(bench.cell), 50, bench.clock.now()));
  REQUIRE(bench.robot_says()->kind == hal::RobotEvent::Kind::moving);
  REQUIRE(bench.robot_says()->kind == hal::RobotEvent::Kind::done);
  REQUIRE(bench.scanner.trigger(1, bench.clock.now()));
  REQUIRE(bench.scanner_says()->kind == hal::ScannerEvent::Kind::exposed);
  const auto from = bench.world.world_from_scanner(bench.clock.now());
  REQUIRE(bench.scanner_says()->kind == hal::ScannerEvent::Kind::arriving);
  REQUIRE(bench.scanner_says()->kind == hal::ScannerEvent::Kind::frame);

  // Every point, carried into the plate's frame by the true pose, lies on its surface but for the noise.
  const auto& frame = bench.scanner.frame();
  bench.scanner.unpack(frame.point_count);
  REQUIRE(bench.scanner.unpacked() == frame.point_count);
  const auto plate_from_scanner = bench.world.plate().world_from_plate().inverse() * from;
  int seen = 0, near = 0;
  for (std::uint32_t k = 0; k < frame.point_count; ++k) {
    if (std::isnan(frame.x[k])) continue;
    ++seen;
    const Eigen::Vector3d p = plate_from_scanner * Eigen::Vector3d{frame.x[k], frame.y[k], frame.z[k]};
    near += std::abs(p.z() - bench.world.plate().plate->height(p.x(), p.y())) < 0.25;
  }
  CHECK(seen > 49000);
  CHECK(near > 0.998 * seen);
}

TEST_CASE("after a cut cable the drivers come back, and no motion and no exposure happens twice") {
  Bench bench;
  bench.make_ready();
  REQUIRE(bench.robot.move(start_pose(bench.cell), 50, bench.clock.now()));
  REQUIRE(bench.robot_says()->kind == hal::RobotEvent::Kind::moving);
  REQUIRE(bench.robot_says()->kind == hal::RobotEvent::Kind::done);
  REQUIRE(bench.scanner.trigger(1, bench.clock.now()));
  REQUIRE(bench.scanner_says()->kind == hal::ScannerEvent::Kind::exposed);
  bench.scanner_cable.cut();
  REQUIRE(bench.scanner_says()->kind == hal::ScannerEvent::Kind::lost);
  bench.scanner_cable.mend();
  REQUIRE(bench.scanner_says()->kind == hal::ScannerEvent::Kind::ready);
  REQUIRE(bench.scanner_says()->kind == hal::ScannerEvent::Kind::arriving);
  REQUIRE(bench.scanner_says()->kind ==
          hal::ScannerEvent::Kind::frame);  // the stored one, asked for by its id
  CHECK(bench.world.scanner().counters().exposures == 1);
  CHECK(bench.world.robot().counters().most_executions == 1);
}

TEST_CASE("an unreachable target is refused, an emergency stop is a fault that reset clears after release") {
  Bench bench;
  bench.make_ready();
  auto far = start_pose(bench.cell);
  far.x_mm = 1200;
  REQUIRE(bench.robot.move(far, 50, bench.clock.now()));
  CHECK(bench.robot_says()->kind == hal::RobotEvent::Kind::refused);
  CHECK(bench.world.robot().last_refusal().starts_with("the tip would be"));
  REQUIRE(bench.robot.move(start_pose(bench.cell), 5, bench.clock.now()));
  REQUIRE(bench.robot_says()->kind == hal::RobotEvent::Kind::moving);
  bench.world.robot().press_emergency_stop(bench.clock.now());
  CHECK(bench.robot_says()->kind == hal::RobotEvent::Kind::fault);
  bench.world.robot().release_emergency_stop();
  bench.robot.reset(bench.clock.now());
  const auto ready = bench.robot_says();
  CHECK(ready->kind == hal::RobotEvent::Kind::ready);
  CHECK(ready->calibrated);
  CHECK(bench.world.robot().counters().motions == 1);
}
