#include "hal/robot/line_robot.hpp"

#include "hal/driver_bench.hpp"
#include "hal/loss_of.hpp"
#include "hal/robot_peer.hpp"

#include <doctest/doctest.h>

#include <random>

using namespace moldloft::hal;
using Kind = RobotEvent::Kind;

namespace {

const Pose there{
    .x_mm = 412.35, .y_mm = -88.12, .z_mm = 155, .yaw = 0, .pitch = 180 * degree, .roll = 35 * degree};

// On a cable of 115200 baud.
struct Cell : DriverBench<LineRobot, RobotPeer, RobotEvent> {
  Cell() : DriverBench{{.capacity_bytes = 4096, .bytes_per_second = 11520}} {}
  LineRobot& robot = driver;
};

}  // namespace

TEST_CASE("after the link is open: SYN, STA, POS, then ready with the pose that the robot reports") {
  Cell cell;
  cell.robot.start(cell.clock.now());
  CHECK(cell.robot.state() == RobotState::offline);
  CHECK_FALSE(cell.robot.move(there, 50, cell.clock.now()));
  REQUIRE(cell.run_until(Kind::ready));
  CHECK(cell.peer.heard == std::vector<std::string>{"0000 SYN 2", "0000 STA", "0000 POS"});
  CHECK(cell.events.back().pose.x_mm == 400);
  CHECK(cell.events.back().calibrated);
  CHECK(cell.robot.state() == RobotState::ready);
}

TEST_CASE("a motion: ACK, DON, and the pose is the one that was read back") {
  Cell cell;
  cell.start();
  REQUIRE(cell.robot.move(there, 50, cell.clock.now()));
  CHECK(cell.robot.state() == RobotState::commanded);
  CHECK_FALSE(cell.robot.move(there, 50, cell.clock.now()));
  REQUIRE(cell.run_until(Kind::moving));
  CHECK(cell.robot.state() == RobotState::moving);
  REQUIRE(cell.run_until(Kind::done));
  CHECK(cell.events.back().pose == there);
  CHECK(cell.robot.state() == RobotState::ready);
  CHECK(cell.peer.motions == 1);
  CHECK(cell.peer.times_heard("0001 MOV 412.350 -88.120 155.000 0.000 180.000 35.000 50") == 1);
  CHECK(loss_of(cell.robot, "repeated lines") == 0);
}

TEST_CASE("a calibration goes the same way") {
  Cell cell;
  cell.start();
  REQUIRE(cell.robot.calibrate(cell.clock.now()));
  REQUIRE(cell.run_until(Kind::done));
  CHECK(cell.peer.calibrations == 1);
  CHECK(cell.peer.times_heard("0001 CAL") == 1);
}

TEST_CASE("a command that cannot be said is never sent") {
  Cell cell;
  cell.start();
  CHECK_FALSE(cell.robot.move({.x_mm = NAN}, 50, cell.clock.now()));
  CHECK_FALSE(cell.robot.move({.x_mm = 1e7}, 50, cell.clock.now()));
  CHECK_FALSE(cell.robot.move(there, 0, cell.clock.now()));
  CHECK_FALSE(cell.robot.move(there, 101, cell.clock.now()));
  CHECK(cell.robot.state() == RobotState::ready);
  cell.run(1s);
  CHECK(cell.peer.times_heard("0001") == 0);
  REQUIRE(cell.robot.move(there, 50, cell.clock.now()));  // and no number was used up
  REQUIRE(cell.run_until(Kind::done));
  CHECK(cell.peer.times_heard("0001 MOV") == 1);
}

TEST_CASE("numbers run from 0001 to 9999 and on to 0001") {
  Cell cell;
  cell.peer.motion_time = 0ms;
  cell.start();
  for (int i = 0; i < 10'001; ++i) {
    REQUIRE(cell.robot.calibrate(cell.clock.now()));
    REQUIRE(cell.run_until(Kind::done));
    cell.events.clear();
  }
  CHECK(cell.peer.calibrations == 10'001);
  CHECK(cell.peer.times_heard("9999 CAL") == 1);
  CHECK(cell.peer.times_heard("0002 CAL") == 2);
}

TEST_CASE("an ACK that is lost brings the same line again, and the arm moves once") {
  Cell cell;
  cell.start();
  int acks = 0;
  cell.peer.on_reply = [&](std::string& line) {
    return line.find(" ACK") == std::string::npos || ++acks > 1;
  };
  cell.peer.motion_time = 5s;
  REQUIRE(cell.robot.move(there, 50, cell.clock.now()));
  const Instant asked = cell.clock.now();
  REQUIRE(cell.run_until(Kind::moving));
  CHECK(cell.clock.now() - asked >= 500ms);
  CHECK(cell.clock.now() - asked <= 540ms);  // ack timeout, two line times, the answer's way back
  CHECK(cell.peer.times_heard("0001 MOV") == 2);
  REQUIRE(cell.run_until(Kind::done));
  CHECK(cell.peer.motions == 1);
}

TEST_CASE("a DON that is lost is fetched after the next status, and the arm moves once") {
  Cell cell;
  cell.start();
  int dones = 0;
  cell.peer.on_reply = [&](std::string& line) {
    return line.find(" DON") == std::string::npos || ++dones > 1;
  };
  REQUIRE(cell.robot.move(there, 50, cell.clock.now()));
  REQUIRE(cell.run_until(Kind::done, 2s));
  CHECK(cell.events.back().pose == there);
  CHECK(cell.peer.motions == 1);
  CHECK(cell.peer.times_heard("0001 MOV") == 2);
}

TEST_CASE("a line that the robot got garbled comes again at once, under the same number") {
  Cell cell;
  cell.start();
  int moves = 0;
  cell.peer.on_line = [&](std::string& line) {
    if (line.find("MOV") != std::string::npos && ++moves == 1) line[12] ^= 1;
  };
  const Instant asked = cell.clock.now();
  REQUIRE(cell.robot.move(there, 50, asked));
  REQUIRE(cell.run_until(Kind::moving));
  CHECK(cell.clock.now() - asked < 50ms);
  CHECK(cell.peer.times_heard("0001 MOV") == 1);
  CHECK(cell.peer.motions == 1);
}

TEST_CASE("a reply that came garbled is asked for again soon, and counted") {
  Cell cell;
  cell.start();
  int dones = 0;
  cell.peer.on_reply = [&](std::string& line) {
    if (line.find(" DON") != std::string::npos && ++dones == 1) line[10] ^= 1;
    return true;
  };
  REQUIRE(cell.robot.move(there, 50, cell.clock.now()));
  REQUIRE(cell.run_until(Kind::done, 300ms));  // 200 ms of motion and the repeat
  CHECK(loss_of(cell.robot, "garbled lines") == 1);
  CHECK(cell.peer.motions == 1);
}

TEST_CASE("a noisy line both ways: every motion happens once, and every DON belongs to its MOV") {
  for (std::uint32_t seed = 1; seed <= 40; ++seed) {
    CAPTURE(seed);
    Cell cell;
    cell.start();
    std::mt19937 random{seed};
    const auto damage = [&](std::string& line) {
      if (random() % 5 == 0) line[random() % (line.size() - 1)] ^= static_cast<char>(1 << (random() % 7));
      if (random() % 10 == 0) line.erase(random() % (line.size() - 1), 1);
    };
    cell.peer.on_line = damage;
    cell.peer.on_reply = [&](std::string& line) {
      damage(line);
      return random() % 8 != 0;
    };
    for (int i = 1; i <= 10; ++i) {
      CAPTURE(i);
      Pose target = there;
      target.x_mm = i;
      REQUIRE(cell.robot.move(target, 50, cell.clock.now()));
      REQUIRE(cell.run_until(Kind::done, 60s));
      REQUIRE(cell.events.back().pose.x_mm == i);
      REQUIRE(cell.peer.motions == i);
    }
    CHECK(cell.count(Kind::fault) == 0);
    CHECK(cell.count(Kind::lost) == 0);
  }
}

TEST_CASE("an answer that comes twice, or belongs to an earlier command, changes nothing") {
  Cell cell;
  cell.peer.on_reply = [](std::string& line) {
    if (line.find(" DON") != std::string::npos) line += line;
    return true;
  };
  cell.start();
  for (int i = 1; i <= 3; ++i) {
    REQUIRE(cell.robot.move(there, 50, cell.clock.now()));
    cell.peer.say({.number = i == 1 ? 9999 : i - 1, .verb = robot_line::Verb::don, .pose = {.x_mm = -1}});
    REQUIRE(cell.run_until(Kind::done));
    CHECK(cell.events.back().pose == there);
  }
  cell.run(1s);
  CHECK(cell.count(Kind::done) == 3);
  CHECK(cell.peer.motions == 3);
}

TEST_CASE("ERR before the motion is a refusal, and the next command has the next number") {
  Cell cell;
  cell.start();
  cell.peer.next_error = -1012;
  REQUIRE(cell.robot.move(there, 50, cell.clock.now()));
  REQUIRE(cell.run_until(Kind::refused));
  CHECK(cell.events.back().code == -1012);
  CHECK(cell.robot.state() == RobotState::ready);
  CHECK(cell.peer.motions == 0);
  REQUIRE(cell.robot.move(there, 50, cell.clock.now()));
  REQUIRE(cell.run_until(Kind::done));
  CHECK(cell.peer.times_heard("0002 MOV") == 1);
}

TEST_CASE("ERR during the motion is a fault: latched until an operator clears it") {
  Cell cell;
  cell.start();
  REQUIRE(cell.robot.move(there, 50, cell.clock.now()));
  REQUIRE(cell.run_until(Kind::moving));
  cell.peer.say({.number = 1, .verb = robot_line::Verb::err, .code = -674});
  REQUIRE(cell.run_until(Kind::fault));
  CHECK(cell.events.back().code == -674);
  cell.run(5s);
  CHECK(cell.robot.state() == RobotState::faulted);
  CHECK_FALSE(cell.robot.move(there, 50, cell.clock.now()));
  cell.robot.reset(cell.clock.now());
  REQUIRE(cell.run_until(Kind::ready));
}

TEST_CASE("the robot restarts in motion: its command is given up, never sent under another number") {
  Cell cell;
  cell.start();
  cell.peer.motion_time = 10s;
  REQUIRE(cell.robot.move(there, 50, cell.clock.now()));
  REQUIRE(cell.run_until(Kind::moving));
  cell.run(1s);
  cell.peer.reboot();
  REQUIRE(cell.run_until(Kind::fault, 3s));
  CHECK(cell.robot.state() == RobotState::faulted);
  cell.run(20s);
  CHECK(cell.peer.motions == 1);
  cell.robot.reset(cell.clock.now());
  REQUIRE(cell.run_until(Kind::ready));
  CHECK(cell.events.back().pose.x_mm == 400);  // the cell compares: the arm never came to its target
  cell.run(5s);
  CHECK(cell.peer.motions == 1);
}

TEST_CASE("the robot restarts before it has seen the line: not even then does it move unasked") {
  Cell cell;
  cell.start();
  cell.peer.reboot();
  REQUIRE(cell.robot.move(there, 50, cell.clock.now()));
  REQUIRE(cell.run_until(Kind::fault));
  cell.run(10s);
  CHECK(cell.peer.motions == 0);
}

TEST_CASE("NAK SQ for our command is a fault, for an older one it is an echo") {
  Cell cell;
  cell.start();
  cell.peer.motion_time = 2s;
  REQUIRE(cell.robot.move(there, 50, cell.clock.now()));
  REQUIRE(cell.run_until(Kind::moving));
  cell.peer.say({.number = 9999,
                 .verb = robot_line::Verb::nak,
                 .refusal = robot_line::Refusal::sequence,
                 .last_number = 1});
  cell.run(100ms);
  CHECK(cell.robot.state() == RobotState::moving);
  cell.peer.say({.number = 1,
                 .verb = robot_line::Verb::nak,
                 .refusal = robot_line::Refusal::sequence,
                 .last_number = 7});
  REQUIRE(cell.run_until(Kind::fault));
}

TEST_CASE("the emergency stop is a fault at once, clearing it too early is the same fault again") {
  Cell cell;
  cell.start();
  cell.peer.motion_time = 10s;
  REQUIRE(cell.robot.move(there, 50, cell.clock.now()));
  REQUIRE(cell.run_until(Kind::moving));
  cell.peer.press_emergency_stop();
  REQUIRE(cell.run_until(Kind::fault, 50ms));
  CHECK(cell.events.back().code == static_cast<int>(robot_line::Event::emergency_stop));
  cell.robot.reset(cell.clock.now());
  REQUIRE(cell.run_until(Kind::fault));
  cell.peer.release_emergency_stop();
  cell.run(5s);
  CHECK(cell.robot.state() == RobotState::faulted);
  cell.robot.reset(cell.clock.now());
  REQUIRE(cell.run_until(Kind::ready));
  CHECK(cell.peer.motions == 1);
}

TEST_CASE("a fault stays latched through a link that is lost and comes back") {
  Cell cell;
  cell.start();
  cell.peer.press_emergency_stop();
  REQUIRE(cell.run_until(Kind::fault));
  cell.cable.cut();
  cell.run(1s);
  cell.peer.release_emergency_stop();
  cell.cable.mend();
  cell.run(10s);
  CHECK(cell.robot.state() == RobotState::faulted);
  CHECK(cell.peer.nonces.size() == 1);  // no SYN without an operator
  cell.robot.reset(cell.clock.now());
  REQUIRE(cell.run_until(Kind::ready));
}

TEST_CASE("an answer to an earlier SYN does not count") {
  Cell cell;
  cell.peer.mute = true;
  cell.robot.start(cell.clock.now());
  cell.run(50ms);
  cell.peer.mute = false;
  cell.peer.say({.answers = robot_line::Verb::syn, .nonce = 1});
  cell.run(50ms);
  CHECK(cell.robot.state() == RobotState::synchronising);
  CHECK(cell.peer.times_heard("0000 STA") == 0);
  REQUIRE(cell.run_until(Kind::ready, 1s));
}

TEST_CASE("an emergency stop whose message is lost shows in the next status") {
  Cell cell;
  cell.start();
  cell.peer.on_reply = [](std::string& line) { return line.find(" EVT") == std::string::npos; };
  cell.peer.motion_time = 10s;
  REQUIRE(cell.robot.move(there, 50, cell.clock.now()));
  REQUIRE(cell.run_until(Kind::moving));
  cell.peer.press_emergency_stop();
  REQUIRE(cell.run_until(Kind::fault, 1200ms));
}

TEST_CASE("STP goes out at once and again until it is answered, the stopped motion is no fault") {
  Cell cell;
  cell.start();
  cell.peer.motion_time = 10s;
  REQUIRE(cell.robot.move(there, 50, cell.clock.now()));
  REQUIRE(cell.run_until(Kind::moving));
  int stops = 0;
  cell.peer.on_line = [&](std::string& line) {
    if (line.find("STP") != std::string::npos && ++stops == 1) line[3] ^= 1;
  };
  const Instant asked = cell.clock.now();
  cell.robot.stop(asked);
  while (cell.peer.stops == 0 && cell.clock.now() < asked + 1s) cell.tick();
  CHECK(cell.clock.now() - asked < 20ms);
  REQUIRE(cell.run_until(Kind::refused));
  CHECK(cell.events.back().code == static_cast<int>(robot_line::Error::stopped));
  CHECK(cell.robot.state() == RobotState::ready);
  cell.run(3s);
  CHECK(cell.peer.stops == 1);
  REQUIRE(cell.robot.move(there, 50, cell.clock.now()));
  REQUIRE(cell.run_until(Kind::moving));
}

TEST_CASE("a stop that overtakes a garbled command forbids its repeat") {
  Cell cell;
  cell.start();
  cell.peer.on_line = [](std::string& line) {
    if (line.find("MOV") != std::string::npos) line[12] ^= 1;
  };
  REQUIRE(cell.robot.move(there, 50, cell.clock.now()));
  cell.tick();
  cell.robot.stop(cell.clock.now());
  cell.run(30ms);
  cell.peer.on_line = nullptr;
  REQUIRE(cell.run_until(Kind::ready, 5s));
  CHECK(cell.count(Kind::refused) == 1);
  cell.run(5s);
  CHECK(cell.peer.motions == 0);
  REQUIRE(cell.robot.move(there, 50, cell.clock.now()));
  REQUIRE(cell.run_until(Kind::done));
}

TEST_CASE("a silent robot is lost after 3 s, and when it speaks again: SYN, status, position, ready") {
  Cell cell;
  cell.start();
  cell.peer.motion_time = 1s;
  REQUIRE(cell.robot.move(there, 50, cell.clock.now()));
  REQUIRE(cell.run_until(Kind::moving));
  const Instant last_word = cell.clock.now();
  cell.peer.mute = true;
  REQUIRE(cell.run_until(Kind::lost));
  CHECK(cell.clock.now() - last_word >= 3s);
  CHECK(cell.clock.now() - last_word <= 3010ms);
  cell.run(20s);
  CHECK(cell.peer.motions == 1);
  cell.peer.mute = false;
  REQUIRE(cell.run_until(Kind::ready, 1s));
  CHECK(cell.events.back().pose == there);  // it had arrived after all; the cell sees where it stands
  CHECK(cell.peer.motions == 1);
}

TEST_CASE("a robot that still moves when it is found again is stopped before anything else") {
  Cell cell;
  cell.start();
  cell.peer.motion_time = 60s;
  REQUIRE(cell.robot.move(there, 50, cell.clock.now()));
  REQUIRE(cell.run_until(Kind::moving));
  cell.cable.cut();
  REQUIRE(cell.run_until(Kind::lost));
  cell.cable.mend();
  REQUIRE(cell.run_until(Kind::ready, 5s));
  CHECK(cell.peer.stops >= 1);
  CHECK_FALSE(cell.peer.moving());
}

TEST_CASE("a port that is gone is tried again after 100 ms, 200 ms, 400 ms, and every 2 s in the end") {
  Cell cell;
  cell.start();
  cell.cable.cut();
  REQUIRE(cell.run_until(Kind::lost, 5ms));
  CHECK(cell.robot.state() == RobotState::offline);
  CHECK(cell.robot.why() == "the cable is cut");
  cell.run(650ms);  // the attempts at 100 and 300 ms have failed, the next is at 700
  cell.cable.mend();
  const Instant mended = cell.clock.now();
  REQUIRE(cell.run_until(Kind::ready));
  CHECK(cell.clock.now() - mended < 100ms);
  CHECK(cell.peer.nonces.size() == 2);
  CHECK(cell.peer.nonces[0] != cell.peer.nonces[1]);
}

TEST_CASE("the heartbeat: never more than 1 s without a line to the robot") {
  Cell cell;
  cell.start();
  cell.run(10s);
  // An arm that stands is asked in turn how it is and where it stands; each once at the start.
  CHECK(cell.peer.times_heard("0000 STA") == 1 + 5);
  CHECK(cell.peer.times_heard("0000 POS") == 1 + 5);
  cell.peer.motion_time = 5s;
  REQUIRE(cell.robot.move(there, 50, cell.clock.now()));
  REQUIRE(cell.run_until(Kind::done));
  CHECK(cell.peer.times_heard("0000 STA") == 1 + 5 + 5);  // in motion the heartbeat asks for the status
  cell.peer.press_emergency_stop();
  REQUIRE(cell.run_until(Kind::fault));
  cell.run(5s);
  CHECK(cell.peer.times_heard("0000 PNG") == 5);  // a fault is waited out
}

TEST_CASE("a motion that does not end within the limit is stopped and a fault") {
  Cell cell;
  cell.start();
  cell.peer.motion_time = 600s;
  REQUIRE(cell.robot.move(there, 50, cell.clock.now()));
  REQUIRE(cell.run_until(Kind::fault, 61s));
  cell.run(100ms);
  CHECK(cell.peer.stops == 1);
  CHECK_FALSE(cell.peer.moving());
}

TEST_CASE("noise without end, lines without end: the driver keeps its bearings") {
  Cell cell;
  cell.start();
  std::mt19937 random{7};
  std::string noise(5000, 'x');
  for (auto& c : noise) c = static_cast<char>(random() % 256);
  cell.peer.send(noise + std::string(500, 'y') + "\n");
  cell.run(1s);
  CHECK(cell.robot.state() == RobotState::ready);
  CHECK(loss_of(cell.robot, "garbled lines") > 0);
  REQUIRE(cell.robot.move(there, 50, cell.clock.now()));
  REQUIRE(cell.run_until(Kind::done));
}
