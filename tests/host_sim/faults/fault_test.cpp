// Faults as text, and what they do to what a robot says, where an arm stands, what a frame shows, where a plate lies.
#include "host_sim/faults/fault_acts.hpp"
#include "host_sim/plates/plate_shape.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <numbers>
#include <string>

using namespace moldloft;
using namespace moldloft::host_sim;

namespace {

FaultActs acts(const std::string& text, std::uint64_t seed = 1) { return {faults_from(text).value(), seed}; }

double plan_distance(const hal::Pose& a, const hal::Pose& b) {
  return std::hypot(a.x_mm - b.x_mm, a.y_mm - b.y_mm);
}

hal::Frame frame_of(std::size_t points) {
  hal::Frame frame{1, points};
  frame.point_count = static_cast<std::uint32_t>(points);
  for (std::size_t i = 0; i < points; ++i) {
    frame.x[i] = 1.0f;
    frame.y[i] = static_cast<float>(i);
    frame.z[i] = 2.0f;
  }
  return frame;
}

long seen(const hal::Frame& frame) {
  return std::count_if(frame.z.begin(), frame.z.begin() + frame.point_count,
                       [](float z) { return std::isfinite(z); });
}

const hal::Pose pose{.x_mm = 400, .y_mm = 50, .z_mm = 300, .pitch = 180 * hal::degree};

}  // namespace

TEST_CASE("faults are read as they are written, and what is not understood is refused with what is known") {
  for (const char* text :
       {"robot-lies 5 at 7", "noise 20", "scanner-blind 0.5 from surface", "mount-yawed -1",
        "robot-stays from 3", "plate-pushed 3.25, mount-shifted 5", "scanner-freezes at surface"}) {
    const auto faults = faults_from(text);
    REQUIRE(faults);
    CHECK(text_of(*faults) == text);
  }
  CHECK(faults_from("  robot-lies   5  ,noise 2 ").value().size() == 2);
  for (const char* text :
       {"", ",", "robot-lies", "robot-lies five", "robot-lies 5 on 7", "robot-lies 5 at 0",
        "robot-lies 5 at -1", "robot-lies 5 at 7 8", "robot-lies 0", "robot-lies nan", "robot-lies 1e9",
        "scanner-blind 2", "robot-stays 3", "noise 5,", "Robot-lies 5"}) {
    CAPTURE(text);
    CHECK_FALSE(faults_from(text));
  }
  CHECK(faults_from("lies 5").error().what.find("known are robot-lies, robot-tilts,") != std::string::npos);
  CHECK(faults_from("noise 0").error().what.find("noise wants its size, 0.01 to 1000 times") !=
        std::string::npos);
}

TEST_CASE(
    "a robot lies by as much as it was told, at the shots that it was told, always the same way for a seed") {
  auto once = acts("robot-lies 5 at 7"), always = acts("robot-lies 5 from 7"),
       other = acts("robot-lies 5 at 7", 2);
  for (std::uint64_t shot = 1; shot < 12; ++shot) {
    for (auto* a : {&once, &always, &other}) a->next_shot_is(shot, 0), a->arm_sets_out();
    CHECK(plan_distance(once.robot_says(pose), pose) == doctest::Approx(shot == 7 ? 5 : 0));
    CHECK(plan_distance(always.robot_says(pose), pose) == doctest::Approx(shot >= 7 ? 5 : 0));
    CHECK(once.arm_stands(geometry::RigidMotion::Identity()).isApprox(geometry::RigidMotion::Identity()));
    if (shot == 7) {
      CHECK(plan_distance(once.robot_says(pose), always.robot_says(pose)) < 1e-9);
      CHECK(plan_distance(once.robot_says(pose), other.robot_says(pose)) > 0.1);
    }
  }
  auto tilts = acts("robot-tilts 2");
  tilts.next_shot_is(1, 0);
  CHECK(tilts.robot_says(pose) == pose);  // it has gone nowhere yet
  tilts.arm_sets_out();
  CHECK(tilts.robot_says(pose).pitch == doctest::Approx(178 * hal::degree));
}

TEST_CASE("an arm that drifts stands farther off with each shot, however often it is asked") {
  auto drifts = acts("robot-drifts 0.1 from 3");
  for (std::uint64_t shot = 1; shot <= 8; ++shot) {
    for (int again = 0; again < 5; ++again) drifts.next_shot_is(shot, 0);
    const auto stands = drifts.arm_stands(geometry::RigidMotion::Identity());
    CHECK(stands.translation().norm() == doctest::Approx(shot < 3 ? 0 : 0.1 * static_cast<double>(shot - 2)));
    CHECK(drifts.robot_says(pose) == pose);
  }
  auto leans = acts("robot-leans 1");
  leans.next_shot_is(1, 0);
  const auto stands = leans.arm_stands(geometry::RigidMotion::Identity());
  CHECK(std::acos(stands.linear()(2, 2)) == doctest::Approx(hal::degree));
}

TEST_CASE("a scanner is blind for the share it was told, freezes, scales and mirrors what it sees") {
  auto blind = acts("scanner-blind 0.25, scanner-blind 1 from surface");
  blind.next_shot_is(1, 0);
  hal::Frame frame = frame_of(1001);
  blind.spoil(frame);
  CHECK(seen(frame) == 750);  // y from 0 to 1000, the first quarter with its border
  auto surface = acts("scanner-blind 1 at surface");
  for (std::uint64_t shot = 1; shot <= 9; ++shot) {
    surface.next_shot_is(shot, shot >= 5 ? shot - 4 : 0);
    frame = frame_of(100);
    surface.spoil(frame);
    CHECK(seen(frame) == (shot == 5 ? 0 : 100));
  }
  auto frozen = acts("scanner-freezes from 2");
  for (std::uint64_t shot = 1; shot <= 4; ++shot) {
    frozen.next_shot_is(shot, 0);
    frame = frame_of(10);
    frame.z[0] = static_cast<float>(shot);
    frozen.spoil(frame);
    CHECK(frame.z[0] == (shot == 1 ? 1.0f : 2.0f));
  }
  auto wrong = acts("scanner-scales 10, scanner-mirrors");
  wrong.next_shot_is(1, 0);
  frame = frame_of(10);
  wrong.spoil(frame);
  CHECK(frame.x[3] == doctest::Approx(-1.1));
  CHECK(frame.y[3] == doctest::Approx(3.3));
}

TEST_CASE("a plate that is moved lies elsewhere from its shot on, by as much as it was told") {
  const PlateInstance down = resting_on_table(make_plate({}).value(), 500, 20, 0.3);
  auto moved = acts("plate-pushed 12 at 4, plate-turned 2 from 6, plate-lifted 3 from 8");
  for (std::uint64_t shot = 1; shot <= 9; ++shot) {
    moved.next_shot_is(shot, 0);
    const PlateInstance is = moved.lies(down);
    CHECK(std::hypot(is.x_mm - down.x_mm, is.y_mm - down.y_mm) == doctest::Approx(shot >= 4 ? 12 : 0));
    CHECK(is.turn - down.turn == doctest::Approx(shot >= 6 ? 2 * hal::degree : 0));
    CHECK(is.z_mm - down.z_mm == doctest::Approx(shot >= 8 ? 3 : 0));
    CHECK(moved.plate_has_moved() == (shot >= 4));
  }
  // Without a shot the seed draws one, in the middle of a boundary.
  for (std::uint64_t seed = 1; seed <= 50; ++seed) {
    auto drawn = acts("plate-pushed 5", seed);
    std::uint64_t shot = 0;
    while (!drawn.plate_has_moved()) drawn.next_shot_is(++shot, 0);
    CHECK(shot >= 6);
    CHECK(shot <= 20);
  }
}

TEST_CASE("a wrong mount and a noisier scanner are there from the beginning") {
  geometry::RigidMotion mount = geometry::RigidMotion::Identity();
  mount.translation() << 0, 140, 300;
  CHECK(acts("mount-shifted 5").mounted(mount).translation().z() == 300);
  CHECK((acts("mount-shifted 5").mounted(mount).translation() - mount.translation()).norm() ==
        doctest::Approx(5));
  const auto yawed = acts("mount-yawed 1").mounted(mount);
  CHECK(yawed.translation() == mount.translation());
  CHECK(std::atan2(yawed.linear()(1, 0), yawed.linear()(0, 0)) == doctest::Approx(hal::degree));
  CHECK(acts("noise 5, noise 2").noise_factor() == 10);
  CHECK(acts("robot-stays").noise_factor() == 1);
}
