#include "firmware_like/display.hpp"

#include <doctest/doctest.h>

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

TEST_CASE("no progress line is longer than a terminal is wide when it does not have to be") {
  const CellProgress p{.state = CellState::unholding,
                       .phase = Phase::track_boundary,
                       .boundary_shots = 999,
                       .surface_shots = 999,
                       .surface_planned = 999,
                       .retaken = 99,
                       .now = 9999s,
                       .time_left = 9999s,
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
