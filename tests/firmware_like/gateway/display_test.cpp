#include "firmware_like/gateway/display.hpp"

#include <doctest/doctest.h>

#include <fcntl.h>
#include <stdlib.h>
#include <sys/ioctl.h>
#include <unistd.h>

using namespace moldloft;
using namespace moldloft::firmware_like;
using namespace std::chrono_literals;
using tasks::CellProgress;
using tasks::CellState;
using tasks::HoldCause;
using tasks::Phase;

TEST_CASE("progress is one line: time, state and phase, shots, what is left") {
  CellProgress p{.state = CellState::execute,
                 .phase = Phase::scan_surface,
                 .boundary_shots = 16,
                 .surface_shots = 4,
                 .surface_planned = 16,
                 .now = 12'345ms,
                 .time_left = 6s,
                 .left_is_planned = true,
                 .why = {}};
  CHECK(progress_line(p) ==
        "   12.3 s  Execute / ScanSurface     boundary shots  16  surface   4/16  left 6 s");
  p.retaken = 2;
  CHECK(progress_line(p) ==
        "   12.3 s  Execute / ScanSurface     boundary shots  16  surface   4/16  retaken 2  left 6 s");
}

TEST_CASE("what is not known yet is not shown") {
  CHECK(progress_line({}) == "    0.0 s  Idle                      boundary shots   0");
}

TEST_CASE("what the cell waits for is shown, what ends the run is left to the run's last line") {
  CellProgress p{.state = CellState::held,
                 .phase = Phase::track_boundary,
                 .cause = HoldCause::scanner,
                 .now = 1s,
                 .why = "cable pulled"};
  CHECK(progress_line(p).ends_with("boundary shots   0  cable pulled"));
  p.cause = HoldCause::recorder;
  CHECK(progress_line(p).ends_with("cable pulled"));
  for (const auto cause : {HoldCause::person, HoldCause::measurement}) {
    p.cause = cause;
    CHECK(progress_line(p).ends_with("boundary shots   0"));
  }
}

TEST_CASE("what is left is called an estimate until the zig-zag is planned, and its digits pretend nothing") {
  CellProgress p{
      .state = CellState::execute, .phase = Phase::track_boundary, .time_left = 38'400ms, .why = {}};
  CHECK(progress_line(p).ends_with("  left about 40 s"));
  p.time_left = 1s;
  CHECK(progress_line(p).ends_with("  left about 5 s"));
  p.time_left = 254s;
  CHECK(progress_line(p).ends_with("  left about 250 s"));
  p.time_left = 2000s;
  CHECK(progress_line(p).ends_with("  left about 1980 s"));
  p.left_is_planned = true;
  CHECK(progress_line(p).ends_with("  left 2000 s"));
}

TEST_CASE("whom the cell waits for is named, with what that one has come to") {
  const Surroundings around{.scanner = "10.0.0.2:4014", .robot = "/dev/ttyS0", .has_operator = true};
  CellProgress p{.state = CellState::starting, .awaited = tasks::Awaited::scanner, .why = {}};
  CHECK(awaited_text(p, around) == "waiting for the scanner at 10.0.0.2:4014");
  p.awaited_why = "10.0.0.2:4014: refused";
  CHECK(awaited_text(p, around) == "waiting for the scanner: 10.0.0.2:4014: refused");
  CHECK(progress_line(p, around).ends_with("  waiting for the scanner: 10.0.0.2:4014: refused"));
  CHECK(status_line(p, around) == "Starting; waiting for the scanner: 10.0.0.2:4014: refused");
  CHECK(progress_line_within(39, p, around) == "0 s  Starting  awaits scanner");
  p.awaited = tasks::Awaited::both;
  CHECK(awaited_text(p, around) ==
        "waiting for the robot at /dev/ttyS0 and the scanner: 10.0.0.2:4014: refused");
  p.robot_why = "no carrier";
  CHECK(awaited_text(p, around) ==
        "waiting for the robot: no carrier and the scanner: 10.0.0.2:4014: refused");
  p.awaited = tasks::Awaited::calibration;
  CHECK(awaited_text(p, around) == "the robot calibrates");
  p.awaited = tasks::Awaited::word_unhold;
  CHECK(awaited_text(p, around) == "waiting for an operator: moldloft tell unhold, or stop");
  CHECK(awaited_text(p, {}) == "");  // nobody can say it: the run ends instead
  p.awaited = tasks::Awaited::nothing;
  CHECK(awaited_text(p, around) == "");
}

TEST_CASE("a lost scanner is waited for in one breath, and only what is new of it is told beside") {
  const Surroundings around{.scanner = "10.0.0.2:4014", .robot = "/dev/ttyS0", .has_operator = true};
  const std::string reason =
      "10.0.0.2:4014: connection closed; waiting 60 s for it to come back (ctrl-C ends the run)";
  CellProgress p{.state = CellState::held,
                 .phase = Phase::scan_surface,
                 .cause = HoldCause::scanner,
                 .awaited = tasks::Awaited::scanner,
                 .why = std::string_view{reason}};
  p.awaited_why = "10.0.0.2:4014: connection closed";
  CHECK(progress_line(p, around).ends_with("boundary shots   0  " + reason));
  CHECK(status_line(p, around) == "Held / ScanSurface: " + reason);
  const std::string shorter = "0 s  Held / ScanSurface  " + reason;
  CHECK(progress_line_within(shorter.size(), p, around) == shorter);
  CHECK(progress_line_within(shorter.size() - 1, p, around) == "0 s  Held  " + reason);
  p.awaited_why = "10.0.0.2:4014: connection refused";
  CHECK(progress_line(p, around).ends_with(reason + "  now: 10.0.0.2:4014: connection refused"));
  CHECK(status_line(p, around).ends_with(reason + "; now: 10.0.0.2:4014: connection refused"));
  // The cell takes up again, and the scanner is not ready yet: why the cell stood has passed.
  p.cause = HoldCause::none;
  p.why = "";
  CHECK(status_line(p, around).ends_with("; waiting for the scanner: 10.0.0.2:4014: connection refused"));
}

TEST_CASE("a device whose driver speaks of it by its kind is named once") {
  const Surroundings around{.scanner = "10.0.0.2:4014", .robot = "/dev/ttyS0", .has_operator = true};
  CellProgress p{.state = CellState::starting, .awaited = tasks::Awaited::robot, .why = {}};
  p.awaited_why = "the robot does not answer SYN";
  CHECK(awaited_text(p, around) == "waiting for the robot, which does not answer SYN");
  p.awaited = tasks::Awaited::both;
  p.awaited_why = "the scanner does not answer HELLO";
  p.robot_why = "the robot has been silent for 1200 ms";
  CHECK(awaited_text(p, around) ==
        "waiting for the robot, which has been silent for 1200 ms, and the scanner, which does not answer "
        "HELLO");
  p.robot_why = "the robotics lab has no power";  // another word that only begins so
  CHECK(awaited_text(p, around).starts_with("waiting for the robot: the robotics lab"));
}

TEST_CASE("a progress line fits into any terminal, and gives up first what matters least") {
  CellProgress p{.state = CellState::execute,
                 .phase = Phase::scan_surface,
                 .boundary_shots = 16,
                 .surface_shots = 4,
                 .surface_planned = 16,
                 .now = 12'345ms,
                 .time_left = 6s,
                 .left_is_planned = true,
                 .why = {}};
  CHECK(progress_line_within(120, p) == progress_line(p));
  CHECK(progress_line_within(79, p) == "12 s  Execute / ScanSurface  surface 4/16  left 6 s");
  CHECK(progress_line_within(45, p) == "12 s  ScanSurface  surface 4/16  left 6 s");
  CHECK(progress_line_within(39, p) == "12 s  ScanSurface  left 6 s");
  CHECK(progress_line_within(12, p) == "12 s  Sca...");
  p.state = CellState::held;
  p.cause = HoldCause::scanner;
  p.awaited = tasks::Awaited::scanner;
  CHECK(progress_line_within(40, p) == "12 s  Held  surface 4/16  awaits scanner");
  CHECK(progress_line_within(39, p) == "12 s  Held  awaits scanner");
  // A letter that takes two bytes takes one column.
  const std::string letters =
      "\xC3\xBC\xC3\xBC\xC3\xBC\xC3\xBC\xC3\xBC\xC3\xBC\xC3\xBC\xC3\xBC\xC3\xBC\xC3\xBC";
  p.why.assign("Kabel gezogen " + letters);
  CHECK(progress_line_within(50, p) == "12 s  Held  surface 4/16  Kabel gezogen " + letters);
  CHECK(progress_line_within(49, p) == "12 s  Held  surface 4/16  awaits scanner");
  for (std::size_t columns = 1; columns < 120; ++columns) {
    const std::string line = progress_line_within(columns, p);
    std::size_t wide = 0;
    for (const char c : line) wide += (static_cast<unsigned char>(c) & 0xC0u) != 0x80u ? 1 : 0;
    CHECK(wide <= columns);
    CHECK((static_cast<unsigned char>(line[0]) & 0xC0u) != 0x80u);
  }
}

TEST_CASE("a terminal's width is what it says, else what COLUMNS says, else 80") {
  const int pty = ::posix_openpt(O_RDWR | O_NOCTTY | O_CLOEXEC);
  REQUIRE(pty >= 0);
  winsize size{.ws_row = 25, .ws_col = 40, .ws_xpixel = 0, .ws_ypixel = 0};
  REQUIRE(::ioctl(pty, TIOCSWINSZ, &size) == 0);
  CHECK(terminal_columns(pty, "100") == 40);
  size.ws_col = 133;  // the window is pulled wider
  REQUIRE(::ioctl(pty, TIOCSWINSZ, &size) == 0);
  CHECK(terminal_columns(pty, nullptr) == 133);
  size.ws_col = 0;  // a serial console says nothing
  REQUIRE(::ioctl(pty, TIOCSWINSZ, &size) == 0);
  CHECK(terminal_columns(pty, "100") == 100);
  for (const char* nonsense : {"", "0", "-5", "wide", "1e9", "99999999999999999999"})
    CHECK(terminal_columns(pty, nonsense) == 80);
  CHECK(terminal_columns(pty, nullptr) == 80);
  CHECK(renews_lines(pty, "xterm"));
  CHECK_FALSE(renews_lines(pty, "dumb"));
  CHECK_FALSE(renews_lines(pty, ""));
  CHECK_FALSE(renews_lines(pty, nullptr));
  ::close(pty);
  CHECK_FALSE(renews_lines(pty, "xterm"));
}

TEST_CASE("no progress line is longer than a terminal is wide when it does not have to be") {
  const CellProgress p{.state = CellState::unholding,
                       .phase = Phase::track_boundary,
                       .boundary_shots = 999,
                       .surface_shots = 999,
                       .surface_planned = 999,
                       .retaken = 99,
                       .now = 9999s,
                       .time_left = 9999s,
                       .left_is_planned = true,
                       .why = {}};
  CHECK(progress_line(p).size() <= 100);
  CHECK(progress_line(p).find('\n') == std::string::npos);
}

TEST_CASE("the status line holds still while nothing happens, and says what a person has to see to") {
  tasks::CellProgress p{.state = tasks::CellState::execute, .phase = tasks::Phase::scan_surface, .why = {}};
  p.boundary_shots = 14;
  p.surface_shots = 3;
  p.surface_planned = 16;
  p.now = 5s;
  const std::string line = status_line(p);
  CHECK(line == "Execute / ScanSurface, 14 boundary shots, 3 of 16 surface shots");
  p.now = 6s;
  CHECK(status_line(p) == line);
  CHECK(status_line({.state = tasks::CellState::held, .why = "look at the plate"}) ==
        "Held: look at the plate");
  CHECK(status_line({.state = tasks::CellState::stopped, .why = "look at the plate"}) == "Stopped");
}
