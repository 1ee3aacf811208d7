#include "package/own_robot.hpp"

#include "hal/driver_bench.hpp"
#include "hal/loss_of.hpp"

#include <doctest/doctest.h>

#include <string>

using namespace std::chrono_literals;
using moldloft::hal::ByteLink;
using moldloft::hal::Clock;
using moldloft::hal::degree;
using moldloft::hal::Instant;
using moldloft::hal::Pose;
using moldloft::hal::RobotEvent;
using moldloft::hal::RobotState;
using Kind = RobotEvent::Kind;

namespace {

// The arm at the other end of the cable: it counts what really moves.
struct Arm {
  Arm(ByteLink& wire, Clock& time) : link{wire}, clock{time} {}

  ByteLink& link;
  Clock& clock;
  std::string line, place = "400.000 0.000 200.000 0.000 180.000 0.000", target;
  std::vector<std::string> heard;
  int motions = 0;
  bool mute = false, moving = false;
  Instant arrival{};

  void say(const std::string& text) {
    if (!mute) (void)link.write(std::as_bytes(std::span{text.data(), text.size()}));
  }
  void step() {
    if (moving && clock.now() >= arrival) moving = false, place = target, say("D " + place + "\n");
    std::array<std::byte, 256> bytes;
    for (std::size_t count; (count = link.read(bytes)) > 0;) {
      for (std::size_t i = 0; i < count; ++i) {
        if (static_cast<char>(bytes[i]) != '\n') {
          line += static_cast<char>(bytes[i]);
        } else {
          answer();
          line.clear();
        }
      }
    }
  }
  void answer() {
    if (line == "?") return say("P " + place + "\r\n");
    heard.push_back(line);
    if (line == "S" && moving) moving = false, say("E 1\n");
    if (!line.starts_with("M ")) return;
    target = line.substr(2, line.rfind(' ') - 2);
    ++motions, moving = true, arrival = clock.now() + 200ms;
    say("A\n");
  }
};

struct Cell : moldloft::hal::DriverBench<own::OwnRobot, Arm, RobotEvent> {
  Cell() : DriverBench{{.capacity_bytes = 4096, .bytes_per_second = 11520}} {}
};

const Pose there{.x_mm = 412.35, .y_mm = -88.12, .z_mm = 155, .pitch = 180 * degree, .roll = 35 * degree};

}  // namespace

TEST_CASE("own driver: the arm goes where it is told, and the pose is the one that was read back") {
  Cell cell;
  CHECK(cell.driver.state() == RobotState::offline);
  CHECK_FALSE(cell.driver.move(there, 50, cell.clock.now()));
  cell.start();
  CHECK(cell.events.back().pose.x_mm == 400);
  CHECK_FALSE(cell.driver.move({.x_mm = NAN}, 50, cell.clock.now()));
  CHECK_FALSE(cell.driver.move(there, 101, cell.clock.now()));
  REQUIRE(cell.driver.move(there, 50, cell.clock.now()));
  CHECK_FALSE(cell.driver.move(there, 50, cell.clock.now()));
  REQUIRE(cell.run_until(Kind::moving));
  REQUIRE(cell.run_until(Kind::done));
  CHECK(cell.events.back().pose == there);
  CHECK(cell.driver.state() == RobotState::ready);
  CHECK(cell.peer.heard == std::vector<std::string>{"M 412.350 -88.120 155.000 0.000 180.000 35.000 50"});
}

TEST_CASE("own driver: a stop ends the motion and is no fault") {
  Cell cell;
  cell.start();
  REQUIRE(cell.driver.move(there, 50, cell.clock.now()));
  REQUIRE(cell.run_until(Kind::moving));
  cell.driver.stop(cell.clock.now());
  REQUIRE(cell.run_until(Kind::refused));
  CHECK(cell.events.back().code == 1);
  CHECK(cell.driver.state() == RobotState::ready);
  cell.run(1s);
  CHECK(cell.count(Kind::done) == 0);
}

TEST_CASE(
    "own driver: a command whose fate is not known is never said again, and the fault stays until reset") {
  Cell cell;
  cell.start();
  cell.peer.mute = true;
  REQUIRE(cell.driver.move(there, 50, cell.clock.now()));
  REQUIRE(cell.run_until(Kind::fault));
  cell.peer.mute = false;
  cell.run(10s);
  CHECK(cell.peer.motions == 1);
  CHECK(cell.driver.state() == RobotState::faulted);
  CHECK_FALSE(cell.driver.move(there, 50, cell.clock.now()));
  cell.driver.reset(cell.clock.now());
  REQUIRE(cell.run_until(Kind::ready));
  CHECK(cell.events.back().pose == there);  // where it went all the same
}

TEST_CASE("own driver: a cable pulled out in a motion is lost, and back it says where the arm stands") {
  Cell cell;
  cell.start();
  REQUIRE(cell.driver.move(there, 50, cell.clock.now()));
  REQUIRE(cell.run_until(Kind::moving));
  cell.cable.cut();
  REQUIRE(cell.run_until(Kind::lost));
  cell.run(2s);
  CHECK(cell.driver.state() == RobotState::offline);
  cell.cable.mend();
  REQUIRE(cell.run_until(Kind::ready));
  CHECK(cell.peer.motions == 1);
  CHECK(cell.events.back().pose == there);
}

TEST_CASE("own driver: an arm that says nothing is lost, and noise is no answer") {
  Cell cell;
  cell.start();
  for (const std::string noise : {"D 1 2 3\n", "P nan 0 0 0 0 0\n", "E\n", "A\n", "\n", "\xff\xfe\n"})
    cell.peer.say(noise);
  cell.peer.say(std::string(3000, 'P') + "\n");
  cell.run(1s);
  CHECK(cell.events.size() == 1);
  CHECK(cell.driver.state() == RobotState::ready);
  CHECK(moldloft::hal::loss_of(cell.driver, "unexpected lines") == 7);
  cell.peer.mute = true;
  REQUIRE(cell.run_until(Kind::lost));
  CHECK(cell.driver.why() == "robot: the arm does not answer");
}
