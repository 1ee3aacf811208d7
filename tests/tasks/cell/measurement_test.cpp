// Who reads a frame keeps the next one away: from the first byte until its view has been used, or it is lost. So does a
// surface whose sums still hold what the plate before has left.
#include "tasks/cell/measurement.hpp"

#include "tasks/scripted_devices.hpp"

#include <doctest/doctest.h>

#include <array>
#include <cstdint>
#include <vector>

using namespace moldloft;
using namespace moldloft::tasks;
using namespace std::chrono_literals;

namespace {

struct Bench final : CellActions {
  Bench() {
    supervisor.command(CellEvent::start);
    supervisor.take_up_command();
    supervisor.done();
    REQUIRE(supervisor.state() == CellState::execute);
    scanner.last.stripe_count = 1;
    scanner.last.point_count = 1;
    scanner.last.stripes[0] = {.index = 0, .first = 0, .count = 1};
  }
  void carry_out(CellAction action) override {
    if (action == CellAction::measure) measurement.begin();
  }
  void tick() {
    measurement.use_view();
    measurement.step();
    shots.step();
  }
  void arrive() {
    robot.is = hal::RobotState::ready;
    gate.stands_at(robot.moves.back());
    shots.on_arrival(robot.moves.back());
    tick();
  }
  // The shot that the arm stands at is exposed, and its frame begins to come.
  void expose() {
    shots.on_exposed(scanner.triggers.back());
    shots.on_arriving(scanner.triggers.back());
  }

  CellSettings settings;
  ScriptedRobot robot;
  ScriptedScanner scanner;
  hal::Recorder recorder{{.bulk_bytes = 1u << 20, .events_bytes = 1u << 16, .largest_frame_bytes = 1u << 12}};
  Supervisor supervisor{recorder, *this};
  ArmGate gate{robot, settings.workspace, 100};
  DiskWait disk{settings, supervisor, recorder};
  SurfaceTask surface{SurfaceTaskSettings{}};
  Measurement measurement{settings, supervisor, surface, shots};
  ShotTaker shots{settings,
                  supervisor,
                  {.scanner = scanner, .arm = gate, .recorder = recorder, .disk = disk, .archive = nullptr},
                  measurement};
};

constexpr double long_side_mm = 400, short_side_mm = 300, edge_step_mm = 2;

const std::array<Eigen::Vector2d, 4> rectangle = {
    {{0, 0}, {long_side_mm, 0}, {long_side_mm, short_side_mm}, {0, short_side_mm}}};

// Once round the rectangle.
std::vector<Eigen::Vector2d> rectangle_edge() {
  std::vector<Eigen::Vector2d> edge;
  for (std::size_t side = 0; side < rectangle.size(); ++side) {
    const Eigen::Vector2d along = rectangle[(side + 1) % rectangle.size()] - rectangle[side];
    for (double s = edge_step_mm / 2; s < along.norm(); s += edge_step_mm)
      edge.emplace_back(rectangle[side] + s * along.normalized());
  }
  return edge;
}

}  // namespace

TEST_CASE("a frame that is looked at keeps the next one away until its view has been used") {
  Bench b;
  b.tick();
  b.arrive();
  REQUIRE(b.scanner.triggers.size() == 1);
  CHECK(b.measurement.takes_frame());
  b.expose();
  CHECK_FALSE(b.measurement.takes_frame());  // it arrives
  b.shots.on_frame();
  CHECK_FALSE(b.measurement.takes_frame());  // it is whole and looked at
  b.measurement.use_view();
  CHECK_FALSE(b.measurement.takes_frame());  // the look has not ended yet
  for (int i = 0; i < 100 && b.surface.looking(); ++i) b.surface.step(0ns);
  REQUIRE_FALSE(b.surface.looking());
  CHECK_FALSE(b.measurement.takes_frame());  // nobody has used the view
  b.measurement.use_view();
  CHECK(b.measurement.takes_frame());
}

TEST_CASE("a frame that is lost on its way keeps nobody waiting, and the shot is taken again") {
  Bench b;
  b.tick();
  b.arrive();
  b.expose();
  CHECK_FALSE(b.measurement.takes_frame());
  b.measurement.frame_is_lost();
  CHECK(b.measurement.takes_frame());
  CHECK_FALSE(b.surface.looking());
  b.shots.on_failure("no frame");
  b.tick();
  b.arrive();
  CHECK(b.scanner.triggers.size() == 2);
}

TEST_CASE("an arm in place waits with its exposure while somebody still reads the frame before") {
  Bench b;
  b.tick();
  b.arrive();
  b.expose();
  // The arm is free and goes to another place before the frame has come.
  b.shots.order({.centre = {50, 0, 0}}, hal::ShotPurpose::boundary);
  b.tick();
  REQUIRE(b.robot.moves.size() == 2);
  b.shots.on_frame();
  b.arrive();
  CHECK(b.scanner.triggers.size() == 1);  // in place, the frame before is being looked at
  while (b.surface.looking()) b.surface.step(0ns);
  b.tick();
  CHECK(b.scanner.triggers.size() == 2);
}

TEST_CASE(
    "an arm in place waits with its exposure until the sums that the surface before has left are cleared") {
  using Stage = SurfaceTask::Stage;
  Bench b;
  const auto edge = rectangle_edge();
  b.surface.build_outline(edge, rectangle);
  for (int i = 0; i < 100'000 && !b.surface.outline_ready(); ++i) b.surface.step(0ns);
  REQUIRE(b.surface.stage() == Stage::clearing);
  b.tick();
  b.arrive();
  int steps = 0;
  for (; steps < 100'000 && b.surface.stage() != Stage::open; ++steps) {
    b.tick();
    REQUIRE(b.scanner.triggers.empty());
    b.surface.step(0ns);
  }
  REQUIRE(b.surface.stage() == Stage::open);
  CHECK(steps > 2);  // clearing and folding take several
  b.tick();
  CHECK(b.scanner.triggers.size() == 1);
}
