#include "host_sim/devices/robot_server.hpp"

#include "hal/links/cable.hpp"
#include "host_sim/arms/scara_arm.hpp"
#include "host_sim/late_client.hpp"

#include <doctest/doctest.h>

#include <numbers>
#include <optional>
#include <string>
#include <utility>

using namespace moldloft;
using namespace moldloft::host_sim;
using namespace std::chrono_literals;
namespace robot_line = moldloft::hal::robot_line;
using robot_line::Refusal;
using robot_line::Reply;
using robot_line::Verb;

namespace {

// A robot at the far end of a serial cable, and a host that knows the codec and nothing else.
struct Bench {
  hal::VirtualClock clock;
  hal::Cable cable{clock, {.bytes_per_second = 11520}};
  RobotServer robot{cable.device(), ArmDrive(make_scara({}), {}, 1), {}};
  std::string received;

  Bench() { cable.host().open(); }

  void send_text(std::string_view text) { cable.host().write(std::as_bytes(std::span{text})); }
  void send(const robot_line::Command& command) { send_text(robot_line::format(command).view()); }
  void ask(Verb verb, std::uint32_t nonce = 0) {
    robot_line::Command c;
    c.verb = verb;
    c.nonce = nonce;
    send(c);
  }
  void move(int number, double x, double y, int speed = 100) {
    robot_line::Command c;
    c.number = number;
    c.verb = Verb::mov;
    c.pose = {x, y, 330, 0, std::numbers::pi, std::numbers::pi};
    c.speed_percent = speed;
    send(c);
  }
  void calibrate(int number) {
    robot_line::Command c;
    c.number = number;
    c.verb = Verb::cal;
    send(c);
  }
  std::optional<Reply> next(hal::Duration within = 4s, bool keep_alive = true) {
    hal::Instant pinged = clock.now();
    for (const hal::Instant end = clock.now() + within; clock.now() < end;
         clock.sleep_until(clock.now() + 1ms)) {
      robot.step(clock.now());
      if (keep_alive && clock.now() - pinged >= 1s) {
        ask(Verb::png);
        pinged = clock.now();
      }
      char c = 0;
      while (cable.host().read(std::as_writable_bytes(std::span{&c, 1})) == 1) {
        if (c != '\n') {
          received += c;
          continue;
        }
        const auto reply = robot_line::parse_reply(received);
        REQUIRE_MESSAGE(reply.has_value(), received);
        received.clear();
        if (reply->answers == Verb::png) continue;
        return *reply;
      }
    }
    return std::nullopt;
  }
  void make_ready() {
    ask(Verb::syn, 48213);
    REQUIRE(next()->nonce == 48213);
    calibrate(1);
    REQUIRE(next()->verb == Verb::ack);
    REQUIRE(next()->verb == Verb::don);
  }
};

}  // namespace

TEST_CASE("whenever the robot's host comes, what it has sent is not thrown away") {
  for (int looks = 0; looks < 6; ++looks) {
    CAPTURE(looks);
    LateClient link{looks};
    RobotServer robot{link, ArmDrive(make_scara({}), {}, 1), {}};
    for (int step = 0; step < 10; ++step) robot.step(step * 1ms);
    CHECK(link.state() == hal::LinkState::open);
    CHECK(link.openings() == 1);
  }
}

TEST_CASE("numbered lines are refused before SYN, and motion before CAL") {
  Bench bench;
  bench.move(1, 500, 0);
  auto reply = bench.next();
  CHECK(reply->verb == Verb::nak);
  CHECK(reply->refusal == Refusal::not_synchronised);
  bench.ask(Verb::syn, 7);
  CHECK(bench.next()->answers == Verb::syn);
  bench.move(1, 500, 0);
  reply = bench.next();
  CHECK(reply->verb == Verb::err);
  CHECK(reply->code == std::to_underlying(robot_line::Error::not_calibrated));
  CHECK(bench.robot.counters().motions == 0);
}

TEST_CASE("a motion is acknowledged at once and done when the arm has settled") {
  Bench bench;
  bench.make_ready();
  const auto began = bench.clock.now();
  bench.move(2, 500, 40);
  CHECK(bench.next()->verb == Verb::ack);
  const auto done = bench.next();
  REQUIRE(done->verb == Verb::don);
  CHECK(done->number == 2);
  CHECK(done->pose.x_mm == doctest::Approx(500));
  CHECK(done->pose.y_mm == doctest::Approx(40));
  CHECK(bench.clock.now() >= bench.robot.drive().settled_at());
  CHECK(bench.clock.now() - began > 80ms);
}

TEST_CASE("the same number never moves the arm again: ACK on the way, the stored DON after") {
  Bench bench;
  bench.make_ready();
  bench.move(2, 500, 40);
  CHECK(bench.next()->verb == Verb::ack);
  bench.move(2, 500, 40);
  CHECK(bench.next()->verb == Verb::ack);
  const auto done = bench.next();
  REQUIRE(done->verb == Verb::don);
  bench.move(2, 450, -40);  // even if it says something else
  const auto again = bench.next();
  CHECK(again->verb == Verb::don);
  CHECK(again->pose == done->pose);
  CHECK(bench.robot.counters().motions == 1);
  CHECK(bench.robot.counters().most_executions == 1);
}

TEST_CASE("a number out of turn is refused and the last one named") {
  Bench bench;
  bench.make_ready();
  bench.move(5, 500, 40);
  const auto reply = bench.next();
  CHECK(reply->verb == Verb::nak);
  CHECK(reply->refusal == Refusal::sequence);
  CHECK(reply->last_number == 1);
}

TEST_CASE("a garbled line moves nothing and asks for itself again") {
  Bench bench;
  bench.make_ready();
  robot_line::Command c;
  c.number = 2;
  c.verb = Verb::mov;
  c.pose = {500, 40, 330, 0, std::numbers::pi, 0};
  c.speed_percent = 50;
  std::string line(robot_line::format(c).view());
  line[12] = line[12] == '7' ? '8' : '7';
  bench.send_text(line);
  auto reply = bench.next();
  CHECK(reply->number == 0);
  CHECK(reply->refusal == Refusal::checksum);
  bench.send_text(std::string(500, 'x') + "\n");
  CHECK(bench.next()->refusal == Refusal::checksum);
  CHECK(bench.robot.counters().motions == 0);
  bench.send(c);
  CHECK(bench.next()->verb == Verb::ack);
}

TEST_CASE("a target out of reach is an error with its number, stored like a result") {
  Bench bench;
  bench.make_ready();
  bench.move(2, 900, 0);
  CHECK(bench.next()->code == std::to_underlying(robot_line::Error::out_of_reach));
  bench.move(2, 900, 0);
  CHECK(bench.next()->code == std::to_underlying(robot_line::Error::out_of_reach));
  bench.move(3, 500, 0);
  CHECK(bench.next()->verb == Verb::ack);
}

TEST_CASE("three seconds of silence stop the arm and SYN is needed") {
  Bench bench;
  bench.make_ready();
  bench.move(2, -300, 600, 3);  // slow: it would take long
  CHECK(bench.next()->verb == Verb::ack);
  int events = 0, errors = 0;
  for (int k = 0; k < 4; ++k) {  // the event once a second until SYN, and the command's end
    const auto reply = bench.next(5s, false);
    REQUIRE(reply.has_value());
    events += reply->verb == Verb::evt && reply->code == std::to_underlying(robot_line::Event::watchdog);
    errors += reply->verb == Verb::err && reply->number == 2;
  }
  CHECK(events == 3);
  CHECK(errors == 1);
  CHECK(bench.robot.counters().watchdogs == 1);
  bench.move(3, 500, 0);
  CHECK(bench.next()->refusal == Refusal::not_synchronised);
  bench.next(1s);
  const auto at = bench.robot.drive().reported_pose(bench.clock.now());
  CHECK(at.x_mm > 0);  // far from where it would have gone
  bench.ask(Verb::syn, 9);
  CHECK(bench.next()->nonce == 9);
  bench.move(1, 500, 0);  // counted anew
  CHECK(bench.next()->verb == Verb::ack);
}

TEST_CASE("SYN does not stop a motion, but its number is forgotten, and STP then stops it") {
  Bench bench;
  bench.make_ready();
  bench.move(2, -300, 600, 3);
  CHECK(bench.next()->verb == Verb::ack);
  bench.ask(Verb::syn, 77);
  CHECK(bench.next()->nonce == 77);
  bench.ask(Verb::sta);
  CHECK(bench.next()->status.moving);
  bench.move(1, 500, 0);
  CHECK(bench.next()->refusal == Refusal::sequence);  // the arm is not free
  bench.ask(Verb::stp);
  CHECK(bench.next()->answers == Verb::stp);
  CHECK_FALSE(bench.next(1s).has_value());  // nobody asked for that number any more
  bench.move(1, 500, 0);
  CHECK(bench.next()->verb == Verb::ack);
}

TEST_CASE("a calibrated arm calibrates at once, a watchdog needs good lines to be content") {
  Bench bench;
  bench.make_ready();
  const auto asked = bench.clock.now();
  bench.calibrate(2);
  Reply last = *bench.next();
  if (last.verb == Verb::ack) last = *bench.next();
  CHECK(last.verb == Verb::don);
  CHECK(bench.clock.now() - asked < 20ms);
  for (int k = 0; k < 40; ++k) {
    bench.send_text("noise\n");
    const auto until = bench.clock.now() + 100ms;
    while (bench.clock.now() < until) bench.next(until - bench.clock.now(), false);
  }
  CHECK(bench.robot.counters().watchdogs == 1);
}

TEST_CASE("STP ends a motion where the brakes bring it to stand") {
  Bench bench;
  bench.make_ready();
  bench.move(2, -300, 600, 10);
  CHECK(bench.next()->verb == Verb::ack);
  bench.next(500ms);
  bench.ask(Verb::stp);
  CHECK(bench.next()->answers == Verb::stp);  // at once
  bench.ask(Verb::sta);
  CHECK(bench.next()->status.moving);  // it brakes
  const auto failed = bench.next();
  CHECK(failed->code == std::to_underlying(robot_line::Error::stopped));
  CHECK_FALSE(bench.robot.drive().moving(bench.clock.now()));
  bench.move(3, 500, 0);  // the next command is welcome as soon as ERR has come
  CHECK(bench.next()->verb == Verb::ack);
}

TEST_CASE("the emergency stop latches until it is released and SYN has come") {
  Bench bench;
  bench.make_ready();
  bench.robot.press_emergency_stop(bench.clock.now());
  CHECK(bench.next()->code == std::to_underlying(robot_line::Event::emergency_stop));
  bench.ask(Verb::sta);
  const auto status = bench.next()->status;
  CHECK(status.emergency_stop);
  CHECK_FALSE(status.power);
  bench.ask(Verb::syn, 3);
  bench.next();
  bench.move(1, 500, 0);
  CHECK(bench.next()->code == std::to_underlying(robot_line::Error::arm_off));
  bench.robot.release_emergency_stop();
  bench.ask(Verb::syn, 4);
  bench.next();
  bench.move(1, 500, 0);
  CHECK(bench.next()->verb == Verb::ack);
}

TEST_CASE("in manual mode STA says so and numbered lines are errors, a motion that the key interrupts too") {
  Bench bench;
  bench.make_ready();
  bench.move(2, -300, 600, 3);
  CHECK(bench.next()->verb == Verb::ack);
  bench.robot.turn_key(true, bench.clock.now());
  const auto ended = bench.next();
  CHECK(ended->number == 2);
  CHECK(ended->code == std::to_underlying(robot_line::Error::manual));
  bench.ask(Verb::sta);
  CHECK(bench.next()->status.mode == robot_line::Status::Mode::manual);
  bench.move(3, 500, 0);
  CHECK(bench.next()->code == std::to_underlying(robot_line::Error::manual));
  bench.calibrate(4);
  CHECK(bench.next()->code == std::to_underlying(robot_line::Error::manual));
  CHECK(bench.robot.counters().motions == 1);
  bench.robot.turn_key(false, bench.clock.now());
  bench.ask(Verb::sta);
  CHECK(bench.next()->status.mode == robot_line::Status::Mode::calibrated);
  bench.move(5, 500, 0);
  CHECK(bench.next()->verb == Verb::ack);
}

TEST_CASE("STP ends a calibration too, and is answered before the error of what it ends") {
  Bench bench;
  bench.ask(Verb::syn, 5);
  bench.next();
  bench.calibrate(1);
  CHECK(bench.next()->verb == Verb::ack);
  bench.ask(Verb::stp);
  CHECK(bench.next()->answers == Verb::stp);
  CHECK(bench.next()->code == std::to_underlying(robot_line::Error::stopped));
  bench.ask(Verb::sta);
  CHECK(bench.next()->status.mode == robot_line::Status::Mode::automatic);
}

TEST_CASE("a line of a form that does not exist is NAK CK, whatever its checksum") {
  Bench bench;
  bench.make_ready();
  for (const std::string text :
       {"0000 MOV 500.000 0.000 330.000 0.000 180.000 180.000 50", "0005 PNG",
        "0002 MOV 500.000 0.000 330.000", "0002 MOV 500.000 0.000 330.000 0.000 180.000 180.000 0",
        "0002 CAL 1", "0000 SYN 16777216", "0000 SYN"}) {
    CAPTURE(text);
    bench.send_text(">" + text + " *" + std::to_string(robot_line::fletcher16(text)) + "\n");
    const auto reply = bench.next();
    CHECK(reply->verb == Verb::nak);
    CHECK(reply->number == 0);
    CHECK(reply->refusal == Refusal::checksum);
  }
  CHECK(bench.robot.counters().motions == 0);
}

TEST_CASE("the watchdog is armed by SYN, and a line that is refused feeds it all the same") {
  Bench bench;
  CHECK_FALSE(bench.next(5s, false).has_value());
  CHECK(bench.robot.counters().watchdogs == 0);
  bench.ask(Verb::syn, 5);
  bench.next();
  for (int k = 0; k < 5; ++k) {
    bench.move(77, 500, 0);
    CHECK(bench.next(1s, false)->refusal == Refusal::sequence);
    CHECK_FALSE(bench.next(2s, false).has_value());
  }
  CHECK(bench.robot.counters().watchdogs == 0);
  CHECK(bench.next(4s, false)->code == std::to_underlying(robot_line::Event::watchdog));
}
