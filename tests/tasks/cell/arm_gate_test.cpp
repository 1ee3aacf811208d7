// Whichever way a target comes, one that the workspace does not allow never reaches the robot.
#include "tasks/cell/arm_gate.hpp"

#include "tasks/cell/shot_taker.hpp"
#include "tasks/scripted_devices.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <random>
#include <string>
#include <type_traits>

using namespace moldloft;
using namespace moldloft::tasks;
using namespace std::chrono_literals;

namespace {

using Outcome = ArmGate::Outcome;

static_assert(std::is_same_v<decltype(std::declval<ArmGate&>().robot()), const hal::Robot&>,
              "who asks the gate for the robot cannot move it");

const Workspace workspace{
    .x_mm = {-800, 800}, .y_mm = {-500, 500}, .z_mm = {100, 400}, .reach_mm = {200, 850}, .max_step_mm = 600};

// Written without the guard: what the table of limits says.
bool is_allowed(const hal::Pose& p, const hal::Pose& standing) {
  const double reach = std::sqrt(p.x_mm * p.x_mm + p.y_mm * p.y_mm);
  const double dx = p.x_mm - standing.x_mm, dy = p.y_mm - standing.y_mm, dz = p.z_mm - standing.z_mm;
  return std::abs(p.x_mm) <= 800 && std::abs(p.y_mm) <= 500 && p.z_mm >= 100 && p.z_mm <= 400 &&
         reach >= 200 && reach <= 850 && dx * dx + dy * dy + dz * dz <= 600.0 * 600.0;
}

hal::Pose at(double x, double y = 0, double z = 200) { return {.x_mm = x, .y_mm = y, .z_mm = z}; }

// A supervisor in Execute, a shot taker, and devices that obey. The scanner is mounted 100 mm beside the tip, so that a
// half turn of the head puts the tip 200 mm elsewhere.
struct Bench final : CellActions, ShotUser {
  explicit Bench(const hal::Pose& standing = at(500)) {
    settings.tip_from_scanner.translation() << 100, 0, 0;
    settings.workspace = workspace;
    gate.stands_at(standing);
    supervisor.command(CellEvent::start);
    supervisor.take_up_command();
    supervisor.done();
  }

  void carry_out(CellAction) override {}
  bool takes_frame() const override { return true; }
  void frame_comes(const ShotOrder&, const hal::Frame&, hal::Scanner*) override {}
  void frame_is_whole(const ShotOrder&, const hal::Frame&, hal::Scanner*, bool) override { ++whole; }
  void arm_is_free() override {}
  bool visit_again(const ShotPlace&) override { return false; }

  void order(double x, double yaw = 0) {
    shots.order({.centre = {x, 0, 200}, .head_yaw = yaw}, hal::ShotPurpose::boundary);
    shots.step();
  }
  void unhold() {
    supervisor.done();  // the motion has ended: held
    supervisor.command(CellEvent::unhold);
    supervisor.take_up_command();
    supervisor.done();
  }

  int whole = 0;
  CellSettings settings;
  ScriptedRobot robot;
  ScriptedScanner scanner;
  hal::Recorder recorder{{.bulk_bytes = 1u << 16, .events_bytes = 1u << 16, .largest_frame_bytes = 1u << 12}};
  Supervisor supervisor{recorder, *this};
  ArmGate gate{robot, workspace, 100};
  DiskWait disk{settings, supervisor, recorder};
  ShotTaker shots{settings,
                  supervisor,
                  {.scanner = scanner, .arm = gate, .recorder = recorder, .disk = disk, .archive = nullptr},
                  *this};
};

bool says(const hal::Message& why, std::string_view part) { return why.view().find(part) != part.npos; }

}  // namespace

TEST_CASE("the gate sends what the workspace allows, and says of the rest which limit it breaks") {
  ScriptedRobot robot;
  ArmGate gate{robot, workspace, 100};
  gate.stands_at(at(500));
  CHECK(gate.send_checked(at(700), 0ns).outcome == Outcome::sent);
  for (const auto& target :
       {at(801), at(500, 501), at(500, 0, 99), at(800, 400), at(150), at(-200), at(NAN), at(500, INFINITY)}) {
    const auto sending = gate.send_checked(target, 0ns);
    CHECK(sending.outcome == Outcome::refused);
    CHECK(says(sending.why, "target"));
  }
  CHECK(robot.moves == std::vector{at(700)});
}

TEST_CASE("the gate asks the guard before the driver, and says when the driver takes nothing") {
  ScriptedRobot robot;
  ArmGate gate{robot, workspace, 100};
  gate.stands_at(at(500));
  robot.is = hal::RobotState::moving;
  CHECK(gate.send_checked(at(700), 0ns).outcome == Outcome::not_taken);
  CHECK(gate.send_checked(at(900), 0ns).outcome == Outcome::refused);
  CHECK(robot.moves.empty());
}

TEST_CASE(
    "a shot goes out in the one turn of the head that the workspace allows, and in none when it allows "
    "none") {
  Bench inside;
  inside.order(750);  // the tip at 650 or 850 mm
  REQUIRE(inside.robot.moves.size() == 1);
  CHECK(inside.robot.moves[0].x_mm == doctest::Approx(650));

  Bench outside;
  outside.order(950);  // 850 or 1050
  CHECK(outside.robot.moves.empty());
  CHECK(outside.supervisor.state() == CellState::aborting);
  CHECK(outside.supervisor.cause() == HoldCause::measurement);
  CHECK(says(outside.supervisor.why(), "outside the workspace: x"));
}

TEST_CASE("a target that the robot refuses is not tried in a turn that the workspace refuses") {
  Bench bench;
  bench.order(600);  // the tip at 500 or 700 mm: both are allowed
  REQUIRE(bench.robot.moves.size() == 1);
  SUBCASE("allowed: the other turn is tried") {
    bench.shots.on_refusal("robot refuses: 10");
    REQUIRE(bench.robot.moves.size() == 2);
    CHECK(std::abs(bench.robot.moves[1].x_mm - bench.robot.moves[0].x_mm) == doctest::Approx(200));
    bench.shots.on_refusal("robot refuses: 10");
    CHECK(bench.robot.moves.size() == 2);
    CHECK(says(bench.supervisor.why(), "robot refuses: 10 (shot 1 at x 600 y 0 mm)"));
  }
  SUBCASE("the arm has come to stand too far away meanwhile") {
    bench.gate.stands_at(at(-300));
    bench.shots.on_refusal("robot refuses: 10");
    CHECK(bench.robot.moves.size() == 1);
    CHECK(bench.supervisor.state() == CellState::aborting);
    CHECK(says(bench.supervisor.why(), "outside the workspace: step"));
  }
}

TEST_CASE("after an arrival in doubt the same target is checked again from where the arm says it stands") {
  Bench bench;
  bench.order(600);
  REQUIRE(bench.robot.moves.size() == 1);
  const hal::Pose target = bench.robot.moves[0];
  const auto arrive = [&](const hal::Pose& pose) {
    bench.gate.stands_at(pose);
    bench.shots.on_arrival(pose);
    CHECK(bench.supervisor.state() == CellState::holding);
    bench.unhold();
    CHECK(bench.supervisor.state() == CellState::execute);
    bench.shots.step();
  };
  SUBCASE("near: it is sent again") {
    arrive(at(target.x_mm - 100));
    CHECK(bench.robot.moves == std::vector{target, target});
  }
  SUBCASE("too far for one step: it is not") {
    arrive(at(-400));
    CHECK(bench.robot.moves.size() == 1);
    CHECK(bench.supervisor.state() == CellState::aborting);
    CHECK(says(bench.supervisor.why(), "outside the workspace: step"));
  }
}

TEST_CASE("an arm that moves by itself is sent to its target again, and what it may have seen is not used") {
  Bench bench;
  bench.order(600);
  const hal::Pose target = bench.robot.moves.at(0);
  bench.shots.on_arrival(target);
  const auto stand = [&](double off_mm) {
    hal::Pose pose = target;
    pose.y_mm += off_mm;
    return bench.shots.on_standing(pose);
  };
  CHECK_FALSE(stand(0.14));
  CHECK(bench.supervisor.state() == CellState::execute);
  const auto come_back = [&] {
    CHECK(bench.supervisor.state() == CellState::holding);
    CHECK(says(bench.supervisor.why(), "from where it said it stopped"));
    bench.unhold();
    bench.shots.step();
    CHECK(bench.robot.moves == std::vector{target, target});
    CHECK(bench.scanner.triggers.size() <= 1);  // not before it has arrived
    bench.shots.on_arrival(target);
    bench.shots.step();
  };
  SUBCASE("before the exposure") {
    bench.scanner.is = hal::ScannerState::offline;
    bench.shots.step();
    CHECK_FALSE(stand(2));
    come_back();
    bench.scanner.is = hal::ScannerState::ready;
    bench.shots.step();
    CHECK(bench.scanner.triggers.size() == 1);
    CHECK(bench.scanner.forgotten == 0);
  }
  SUBCASE("after the exposure, before its frame") {
    bench.shots.step();
    REQUIRE(bench.scanner.triggers.size() == 1);
    bench.shots.on_exposed(bench.scanner.triggers[0]);
    CHECK(stand(2));
    bench.shots.on_frame();  // it comes all the same, and counts for nothing
    come_back();
    REQUIRE(bench.scanner.triggers.size() == 2);
    CHECK(bench.scanner.triggers[1] != bench.scanner.triggers[0]);
    CHECK(bench.scanner.forgotten == 1);
    CHECK(bench.whole == 0);
    bench.shots.on_exposed(bench.scanner.triggers[1]);
    bench.shots.on_frame();
    CHECK(bench.whole == 1);
  }
}

TEST_CASE("in random orders, refusals, arrivals and doubts no target outside is ever sent") {
  std::mt19937 random{7};
  const auto draw = [&](double low, double high) {
    return std::uniform_real_distribution{low, high}(random);
  };
  int sent = 0, refused = 0;
  for (int run = 0; run < 3000; ++run) {
    hal::Pose standing = at(draw(-800, 800), draw(-500, 500));
    Bench bench{standing};
    std::size_t seen = 0;
    const auto check = [&] {
      for (; seen < bench.robot.moves.size(); ++seen, ++sent)
        CHECK(is_allowed(bench.robot.moves[seen], standing));
    };
    for (int step = 0; step < 6; ++step) {
      const auto what = step == 0 ? 0 : random() % 4;
      if (what == 0) {
        const Eigen::Vector3d near{standing.x_mm + draw(-400, 400), standing.y_mm + draw(-400, 400),
                                   draw(90, 410)};
        bench.shots.order({.centre = near, .head_yaw = draw(-3, 3)}, hal::ShotPurpose::boundary);
      } else if (what == 1) {
        bench.shots.on_refusal("robot refuses: 10");
      } else if (what == 2) {
        standing = at(draw(-800, 800), draw(-500, 500));
        bench.gate.stands_at(standing);
        bench.shots.on_arrival(standing);
      } else {
        bench.unhold();
      }
      check();
      if (bench.supervisor.state() == CellState::execute) bench.shots.step();
      check();
    }
    refused += bench.supervisor.state() == CellState::aborting;
  }
  CHECK(sent > 1000);
  CHECK(refused > 500);
}
