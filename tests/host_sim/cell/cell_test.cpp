#include "hal/links/cable.hpp"
#include "host_sim/base/plan_polygon.hpp"
#include "host_sim/cell/world.hpp"
#include "tasks/planning/tool_pose.hpp"

#include <doctest/doctest.h>

#include <numbers>
#include <string>

using namespace moldloft;
using namespace moldloft::host_sim;
using namespace std::chrono_literals;
namespace robot_line = moldloft::hal::robot_line;

TEST_CASE("every plate with every outline finds a place by seed, and the start lies well inside it") {
  for (const auto shape : shape_names()) {
    for (const auto outline : outline_names()) {
      for (std::uint64_t seed = 1; seed <= 12; ++seed) {
        CAPTURE(shape);
        CAPTURE(outline);
        CAPTURE(seed);
        CellDescription cell;
        cell.plate = shape;
        cell.outline = *outline_named(outline);
        cell.seed = seed;
        const auto plate = placed_plate(cell);
        REQUIRE_MESSAGE(plate.has_value(), plate.error().what);
        std::vector<Eigen::Vector2d> corners;
        for (const auto& c : plate->corners_in_world()) corners.push_back(c);
        CHECK(contains(corners, 510, 0));
        CHECK(distance_to_outline(corners, {510, 0}) > 72.2);  // the field of view is wholly on the plate
        const auto again = placed_plate(cell);
        CHECK(again->x_mm == plate->x_mm);
        CHECK(again->turn == plate->turn);
      }
    }
  }
}

TEST_CASE("the start pose brings the field of view over the middle of the cell") {
  const CellDescription cell;
  const auto at = tasks::motion_of(start_pose(cell)) * nominal_mount();
  CHECK(at.translation().x() == doctest::Approx(510));
  CHECK(std::abs(at.translation().y()) < 1e-3);
  CHECK(at.translation().z() == doctest::Approx(15));
  CHECK((at.linear() - Eigen::Matrix3d::Identity()).norm() < 1e-6);
}

TEST_CASE("a SCARA sees the field's centre with stripes in any direction from 185 to 787 mm") {
  const auto arm = make_scara({});
  const auto all = [&](double radius) {
    for (double heading = 0; heading < std::numbers::pi; heading += 0.05) {
      if (!can_look(*arm, {radius, 0, 15}, heading, nominal_mount())) return false;
    }
    return true;
  };
  CHECK_FALSE(all(180));
  CHECK(all(187));
  CHECK(all(500));
  CHECK(all(786));
  CHECK_FALSE(all(792));
}

TEST_CASE("a plate that is too large for the arm is refused in one line") {
  CellDescription cell;
  cell.sizes.width_mm = 900;
  const auto plate = placed_plate(cell);
  REQUIRE_FALSE(plate.has_value());
  CHECK(plate.error().what ==
        "plate 'saddle' (900 x 900 mm) does not fit under the scara arm: choose a smaller plate, another "
        "place or "
        "another arm");
  cell.arm = ArmKind::gantry;
  CHECK(placed_plate(cell).has_value());
}

TEST_CASE("the world counts where the time goes between the first command and the last done") {
  hal::VirtualClock clock;
  hal::Cable scanner_cable(clock, {}), robot_cable(clock, {.bytes_per_second = 1e6});
  CellDescription cell;
  SimulatedWorld world(cell, *placed_plate(cell), scanner_cable.device(), robot_cable.device());
  scanner_cable.host().open();
  robot_cable.host().open();
  std::array<std::byte, 256> buffer;
  const auto run = [&](hal::Duration d) {
    for (const auto end = clock.now() + d; clock.now() < end; clock.sleep_until(clock.now() + 1ms)) {
      world.step(clock.now());
    }
  };
  const auto say = [&](const robot_line::Command& c) {
    const auto line = robot_line::format(c);
    robot_cable.host().write(std::as_bytes(std::span{line.view()}));
  };
  const auto trigger = [&](std::uint32_t shot) {
    const auto size = hal::psc1::encode(shot, hal::psc1::Trigger{shot}, buffer);
    scanner_cable.host().write(std::span{buffer}.first(size));
  };
  run(500ms);  // before the first command nothing counts
  CHECK(world.times().total == 0ns);
  scanner_cable.host().write(
      std::span{buffer}.first(hal::psc1::encode(1u, hal::psc1::HelloRequest{}, buffer)));
  scanner_cable.host().write(std::span{buffer}.first(hal::psc1::encode(2u, hal::psc1::Config{}, buffer)));
  say({0, robot_line::Verb::syn, {}, 0, 1});
  run(10ms);
  say({1, robot_line::Verb::cal, {}, 0, 0});
  run(2500ms);  // calibrates for 2 s, then nothing for about 0.5 s
  trigger(1);
  run(600ms);  // 0.1 ms + 100 ms, then nothing
  const auto times = world.times();
  CHECK(times.moving == 2s);
  CHECK(times.exposing == 100us);
  CHECK(times.computing == 100ms);
  CHECK(std::chrono::abs(times.total - 2601ms) <= 3ms);
  CHECK(std::chrono::abs(times.idle - 500ms) <= 3ms);
  CHECK(times.standing_fraction() == doctest::Approx(601.0 / 2601).epsilon(0.01));

  say({0, robot_line::Verb::syn, {}, 0, 2});  // the watchdog has struck meanwhile
  run(10ms);
  say({1, robot_line::Verb::mov, {450, 140, 400, 0, std::numbers::pi, std::numbers::pi}, 10, 0});
  run(100ms);
  trigger(2);
  run(2500ms);
  const auto more = world.times();
  const auto arm_busy = more.moving + more.settling - times.moving;
  CHECK(arm_busy > 1s);
  CHECK(more.idle - times.idle == more.total - times.total - arm_busy);  // the scanner worked meanwhile
  CHECK(more.computing == 200ms);
}

TEST_CASE("the scanner looks from where the arm truly is, mount error included") {
  hal::VirtualClock clock;
  hal::Cable scanner_cable(clock, {}), robot_cable(clock, {});
  CellDescription cell;
  cell.drive.errors = {0, 0, 0, 0};
  cell.tip_from_scanner.translation() += Eigen::Vector3d{0.3, 0, 0};
  SimulatedWorld world(cell, *placed_plate(cell), scanner_cable.device(), robot_cable.device());
  const Eigen::Vector3d at = world.world_from_scanner(0ns).translation();
  const Eigen::Vector3d nominal = (world.world_from_tip(0ns) * nominal_mount()).translation();
  CHECK((at - nominal).norm() == doctest::Approx(0.3));
}
