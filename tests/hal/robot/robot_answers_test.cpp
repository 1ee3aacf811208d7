// A robot program that somebody has written from PROTOCOLS.md and got one thing wrong: what the driver says names it.
#include "hal/driver_bench.hpp"
#include "hal/loss_of.hpp"
#include "hal/robot/line_robot.hpp"
#include "hal/robot_peer.hpp"

#include <doctest/doctest.h>

using namespace moldloft::hal;
using namespace std::string_literals;
using Kind = RobotEvent::Kind;
using robot_line::Verb;

namespace {

const Pose there{.x_mm = 412.35, .y_mm = -88.12, .z_mm = 155, .pitch = 180 * degree, .roll = 35 * degree};

struct Cell : DriverBench<LineRobot, RobotPeer, RobotEvent> {
  explicit Cell(const LineRobot::Settings& settings = {})
      : DriverBench{{.capacity_bytes = 4096, .bytes_per_second = 11520}, settings} {}
  LineRobot& robot = driver;

  // Answers with `text`, under a right checksum, wherever a good robot's line would begin with `verb`.
  void answer(const std::string& verb, const std::string& text) {
    peer.on_reply = [=](std::string& line) {
      if (line.starts_with("<0000 " + verb))
        line = "<" + text + " *" + std::to_string(robot_line::fletcher16(text)) + "\n";
      return true;
    };
  }
  std::string why_after(Duration time) {
    robot.start(clock.now());
    run(time);
    return std::string{robot.why()};
  }
};

}  // namespace

TEST_CASE("a robot in manual mode is a fault that names it, and nothing that moves the arm is sent") {
  Cell cell;
  cell.peer.status.mode = robot_line::Status::Mode::manual;
  cell.robot.start(cell.clock.now());
  REQUIRE(cell.run_until(Kind::manual));
  CHECK(cell.events.back().text.view() == "robot: it is in manual mode; switch it to automatic, then go on");
  CHECK_FALSE(cell.robot.move(there, 50, cell.clock.now()));
  CHECK_FALSE(cell.robot.calibrate(cell.clock.now()));
  cell.robot.reset(cell.clock.now());  // too early: the same fault again
  REQUIRE(cell.run_until(Kind::manual));
  cell.peer.status.mode = robot_line::Status::Mode::automatic;
  cell.robot.reset(cell.clock.now());
  REQUIRE(cell.run_until(Kind::ready));
  CHECK_FALSE(cell.events.back().calibrated);
  CHECK(cell.peer.motions + cell.peer.calibrations == 0);
}

TEST_CASE("the key turned to manual between two motions is a fault too, by ERR or by the next status") {
  Cell refuses;
  refuses.start();
  refuses.peer.next_error = static_cast<int>(robot_line::Error::manual);
  REQUIRE(refuses.robot.move(there, 50, refuses.clock.now()));
  REQUIRE(refuses.run_until(Kind::manual));
  CHECK(refuses.events.back().text.view().find("manual mode") != std::string_view::npos);

  Cell shows;
  shows.start();
  shows.peer.motion_time = 10s;
  REQUIRE(shows.robot.move(there, 50, shows.clock.now()));
  REQUIRE(shows.run_until(Kind::moving));
  shows.peer.status.mode = robot_line::Status::Mode::manual;
  REQUIRE(shows.run_until(Kind::manual));
  CHECK(shows.robot.state() == RobotState::faulted);
}

TEST_CASE("every SYN that begins anew has another nonce, and the largest is followed by 0") {
  Cell cell{{.first_nonce = robot_line::largest_nonce - 1}};
  cell.start();
  for (int i = 0; i < 3; ++i) {
    cell.robot.reset(cell.clock.now());
    REQUIRE(cell.run_until(Kind::ready));
  }
  CHECK(cell.peer.nonces == std::vector<std::uint32_t>{16777215, 0, 1, 2});
}

TEST_CASE("an answer to SYN with another nonce is named, and not believed") {
  Cell cell;
  cell.answer("SYN", "0000 SYN 1234");
  CHECK(cell.why_after(1s) ==
        "the robot answers SYN 2 with SYN 1234: it must send the number back as it came");
  CHECK(cell.robot.state() == RobotState::synchronising);
}

TEST_CASE("a robot that always says that it moves is waited for by that name") {
  Cell cell;
  cell.answer("STA", "0000 STA 1 0 1 2 0");
  CHECK(cell.why_after(5s) == "the robot says that it moves; STP was sent, and no motion before it stands");
  CHECK(cell.peer.motions == 0);
  CHECK(cell.peer.stops >= 1);
}

TEST_CASE("an answer of the wrong form is shown with what is wrong with it, though SYN was answered") {
  const struct {
    const char *verb, *text, *what;
  } answers[] = {
      {"STA", "0000 STA 1 0 0 2", "wrong fields for this verb"},
      {"STA", "0000 STA on off off auto 0", "wrong fields for this verb"},
      {"STA", "0000 STATUS 1 0 0 2 0", "unknown verb"},
      {"STA", "0 STA 1 0 0 2 0", "number wrong for this verb"},
      {"POS", "0000 POS 412,350 0 0 0 180 0", "wrong fields for this verb"},
      {"POS", "0000 POS nan 0 0 0 180 0", "wrong fields for this verb"},
      {"POS", "0000 POS 1e9 0 0 0 180 0", "wrong fields for this verb"},
  };
  for (const auto& answer : answers) {
    CAPTURE(answer.text);
    Cell cell;
    cell.answer(answer.verb, answer.text);
    const std::string why = cell.why_after(9s);  // the driver has begun anew more than once by then
    CHECK(why.find("cannot be read, "s + answer.what) != std::string::npos);
    CHECK(why.find("\"<"s + answer.text) != std::string::npos);
    CHECK(cell.count(Kind::ready) == 0);
    Cell at_once;
    at_once.answer(answer.verb, answer.text);
    CHECK(at_once.why_after(1s).find("cannot be read, "s + answer.what) != std::string::npos);
  }
}

TEST_CASE("what comes instead of lines is shown, printable, and is no silence") {
  const struct {
    std::string piece, what, shown;
  } torrents[] = {
      {"\xFF\xB0\x00\x1b"s, "it has no line end", "\"ÿ°??ÿ°??"},
      {"login: \r\n", "does not begin with the right character", "\"login: \""},
      {"<0000 STA 1 0 0 2 0 *1\n", "checksum wrong", "\"<0000 STA 1 0 0 2 0 *1\""},
      {"<0000 \xB0 *1\n", "a character that has no place in a line", "\"<0000 ° *1\""},
      {"<" + std::string(120, '0') + "\n", "longer than 120 characters", "\"<000"},
  };
  for (const auto& torrent : torrents) {
    CAPTURE(torrent.what);
    Cell cell;
    cell.start();
    cell.peer.on_reply = [&](std::string& line) {
      line.clear();
      for (int i = 0; i < 4; ++i) line += torrent.piece;
      return true;
    };
    REQUIRE(cell.run_until(Kind::lost));
    const std::string text{cell.events.back().text.view()};
    CAPTURE(text);
    CHECK(text.starts_with("the robot's answer cannot be read, " + torrent.what));
    CHECK(text.find(torrent.shown) != std::string::npos);
    CHECK(text.find("silent") == std::string::npos);
    cell.peer.on_reply = {};
    REQUIRE(cell.run_until(Kind::ready));  // and it comes back
  }
}

TEST_CASE("a robot that says nothing is silent, whatever noise there was long before") {
  Cell cell;
  cell.start();
  cell.peer.send("noise\n");
  cell.run(2s);
  cell.peer.mute = true;
  REQUIRE(cell.run_until(Kind::lost));
  CHECK(cell.events.back().text.view().starts_with("the robot has been silent for 300"));
}

TEST_CASE("numbers that are none, or too long, never pass for a pose") {
  const auto reads = [](const std::string& x) {
    const std::string text = "0123 DON " + x + " 0.000 0.000 0.000 180.000 0.000";
    return robot_line::parse_reply("<" + text + " *" + std::to_string(robot_line::fletcher16(text)));
  };
  for (const char* x : {"nan", "inf", "-inf", "1e9", "+5", "0x10", "1,5", "1.", ".5", "-", "--1", "1.2345",
                        "1234567", "1234567.0", "1.-5", "", "1 2", "1e-3", "١"})
    CHECK_MESSAGE(!reads(x).has_value(), x);
  CHECK(reads("-0")->pose.x_mm == 0);
  CHECK_FALSE(std::signbit(reads("-0.000")->pose.x_mm));
  CHECK(reads("999999.999")->pose.x_mm == 999999.999);
  CHECK(reads("000007.5")->pose.x_mm == 7.5);
}

TEST_CASE("a line of 120 characters is told by what is wrong in it, one of 121 by its length") {
  for (const std::size_t length : {120, 121}) {
    CAPTURE(length);
    Cell cell;
    cell.peer.on_reply = [=](std::string& line) {
      line = "<" + std::string(length - 1, 'x') + "\n";
      return true;
    };
    const std::string why = cell.why_after(9s);
    CHECK(why.find("cannot be read, ") != std::string::npos);
    CHECK((why.find("longer than 120 characters") != std::string::npos) == (length == 121));
  }
}

TEST_CASE("a line of 120 characters is read, one of 121 is not, and CR and empty lines change nothing") {
  Cell cell;
  int sent = 0;
  cell.peer.on_reply = [&](std::string& line) {
    ++sent;
    line.insert(line.size() - 1, "\r");
    line = "\r\n\n" + line + "\r\n";
    return true;
  };
  cell.start();
  CHECK(loss_of(cell.robot, "garbled lines") == 0);
  cell.peer.send("<" + std::string(120, 'x') + "\n");
  cell.run(50ms);
  CHECK(loss_of(cell.robot, "garbled lines") == 1);
  cell.peer.send("<0000 PNG\0 *1\n"s);
  cell.run(50ms);
  CHECK(loss_of(cell.robot, "garbled lines") == 2);
  CHECK(cell.robot.state() == RobotState::ready);
}

TEST_CASE("an arm that stands is asked where, and two answers in a row of another place are told") {
  Cell cell;
  cell.start();
  REQUIRE(cell.robot.move(there, 50, cell.clock.now()));
  REQUIRE(cell.run_until(Kind::done));
  const auto asked = cell.peer.times_heard("0000 POS");
  cell.run(3500ms);
  CHECK(cell.peer.times_heard("0000 POS") - asked == 2);  // 50 ms after DON, then by turns with STA
  CHECK(cell.events.back().kind == Kind::done);
  cell.peer.pose.y_mm += 2;  // somebody pushes it
  REQUIRE(cell.run_until(Kind::stands));
  CHECK(cell.events.back().pose.y_mm == doctest::Approx(-86.12));
  cell.events.clear();
  cell.run(5s);
  CHECK(cell.events.empty());  // told once
}

TEST_CASE("one answer of another place, such as an old line that comes twice, is not believed") {
  Cell cell;
  cell.start();
  REQUIRE(cell.robot.move(there, 50, cell.clock.now()));
  REQUIRE(cell.run_until(Kind::done));
  cell.events.clear();
  int answers = 0;
  cell.peer.on_reply = [&](std::string& line) {
    if (line.starts_with("<0000 POS") && ++answers % 2 == 1)
      line = std::string{
          robot_line::format(robot_line::Reply{.pose = {.x_mm = 1}, .answers = Verb::pos}).view()};
    return true;
  };
  cell.run(20s);
  CHECK(answers > 10);
  CHECK(cell.events.empty());
}

TEST_CASE("a robot that confirms a motion and has not moved is found out by where it says it stands") {
  Cell cell;
  cell.start();
  const Pose before = cell.peer.pose;
  cell.peer.on_reply = [&](std::string& line) {
    if (line.find(" DON ") != line.npos) cell.peer.pose = before;  // DON says the target, POS the truth
    return true;
  };
  REQUIRE(cell.robot.move(there, 50, cell.clock.now()));
  REQUIRE(cell.run_until(Kind::done));
  CHECK(cell.events.back().pose == there);
  REQUIRE(cell.run_until(Kind::stands));
  CHECK(cell.events.back().pose == before);
}

TEST_CASE("numbers that no field holds, said under a right checksum, are a fault that shows the line") {
  for (const char* pose :
       {"nan 0.000 155.000 0.000 180.000 35.000", "inf 0.000 155.000 0.000 180.000 35.000",
        "1000000.000 0.000 155.000 0.000 180.000 35.000", "4.1e2 0.000 155.000 0.000 180.000 35.000",
        "412.350 -88.120 155.000", "412,350 -88.120 155.000 0.000 180.000 35.000", ""}) {
    CAPTURE(pose);
    Cell cell;
    cell.start();
    cell.peer.on_reply = [&](std::string& line) {
      if (line.starts_with("<0001 DON")) {
        const std::string text = "0001 DON"s + (*pose == 0 ? "" : " ") + pose;
        line = "<" + text + " *" + std::to_string(robot_line::fletcher16(text)) + "\n";
      }
      return true;
    };
    REQUIRE(cell.robot.move(there, 50, cell.clock.now()));
    const Instant sent = cell.clock.now();
    REQUIRE(cell.run_until(Kind::fault));
    CHECK(cell.clock.now() - sent < 1s);  // not when a command takes too long
    CHECK(cell.events.back().text.view().find("cannot be read, wrong fields") != std::string_view::npos);
    CHECK(cell.events.back().text.view().find("<0001 DON") != std::string_view::npos);
    CHECK(cell.peer.motions == 1);
  }
}
