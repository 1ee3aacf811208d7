// The timeline of a dump: the text is checked against ticks that were written by hand.
#include "firmware_like/report/flight_timeline.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <sstream>
#include <vector>

using namespace moldloft::hal;
using namespace moldloft::firmware_like;

namespace {

constexpr std::int64_t us = 1000, ms = 1000 * us;

FlightEvent event(FlightKind kind, std::uint8_t id, std::int64_t at, std::int64_t value) {
  return {.at_ns = at, .value = static_cast<std::uint32_t>(value), .kind = kind, .id = id};
}

void name(FlightDump& dump, std::size_t task, std::string_view text) {
  std::ranges::copy(text, dump.header.names[task].begin());
}

// Two quiet ticks, then one whose second task takes 1.2 ms, then the tick after the one that was missed.
FlightDump four_ticks() {
  FlightDump dump;
  name(dump, 0, "scanner in");
  name(dump, 1, "cell");
  name(dump, 100, "surface");
  dump.header.cause = FlightCause::missed_tick;
  dump.header.task = 1;
  dump.header.tick = 12;
  dump.header.triggered_ns = 13 * ms + 260 * us;
  auto& e = dump.events;
  e.push_back(
      event(FlightKind::background, 100, 9 * ms + 700 * us, 10 * us));  // of a tick that the ring has lost
  for (const std::int64_t t : {10 * ms, 11 * ms}) {
    e.push_back(event(FlightKind::tick, 0, t + 3 * us, 3 * us));
    e.push_back(event(FlightKind::received, 0, t + 4 * us, 1460));
    e.push_back(event(FlightKind::task, 0, t + 3 * us, 40 * us));
    e.push_back(event(FlightKind::task, 1, t + 43 * us, 2 * us));
    e.push_back(event(FlightKind::background, 100, t + 100 * us, 190 * us));
    e.push_back(event(FlightKind::background, 100, t + 290 * us, 60 * us));
  }
  e.push_back(event(FlightKind::tick, 0, 12 * ms, 0));
  e.push_back(event(FlightKind::task, 0, 12 * ms, 60 * us));
  e.push_back(event(FlightKind::task, 1, 12 * ms + 60 * us, 1200 * us));
  e.push_back(event(FlightKind::sent, 1, 12 * ms + 900 * us, 33));
  e.push_back(event(FlightKind::missed, 1, 13 * ms + 260 * us, 1));
  e.push_back(event(FlightKind::tick, 0, 14 * ms + 1 * us, 1 * us));
  FlightTransition t;
  t.at_ns = 12 * ms + 100 * us;
  std::ranges::copy(std::string_view{"shot"}, t.source.begin());
  std::ranges::copy(std::string_view{"frame"}, t.event.begin());
  std::ranges::copy(std::string_view{"computing"}, t.from.begin());
  std::ranges::copy(std::string_view{"parked"}, t.to.begin());
  dump.transitions.push_back(t);
  return dump;
}

std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream in{text};
  for (std::string line; std::getline(in, line);) lines.push_back(line);
  return lines;
}

}  // namespace

TEST_CASE("a timeline shows who ran when, what came and went, and the tick that was missed") {
  const auto lines = lines_of(flight_timeline(four_ticks(), {.all = true}));
  REQUIRE(lines.size() == 9);
  CHECK(lines[0] == "cause: missed tick in tick 12 at 0.013260 s, task: cell");
  CHECK(lines[1] == "tasks:  1 scanner in  2 cell  ~ surface");
  CHECK(lines[2] == "4 ticks of 1000 us, 0.010 s to 0.014 s");
  // A column is 25 us: 43 us of the first task, its 2 us of the second in the same column, 250 us of background work.
  CHECK(lines[5] ==
        "    0.010003       3.0  11..~~~~~~~~~~~.........................   surface 2 x, longest 190, "
        "scanner in 40"
        "  scanner 1460 in");
  CHECK(lines[7] ==
        "    0.012000       0.0  1112222222222222222222222222222222222222>! cell 1200, scanner in 60  robot "
        "33 out"
        "  [shot: frame computing -> parked]  MISSED 1 (cell)");
  CHECK(lines[8] == "    0.014001       1.0  ........................................");
}

TEST_CASE("a timeline begins so many ticks before the trigger") {
  CHECK(lines_of(flight_timeline(four_ticks(), {.ticks_before = 1})).size() == 5 + 3);
  CHECK(lines_of(flight_timeline(four_ticks(), {.ticks_before = 2})).size() == 5 + 4);
}

TEST_CASE("a crash names the signal and the running task, and shows the last ticks") {
  FlightDump dump = four_ticks();
  dump.header.cause = FlightCause::signal;
  dump.header.signal = 11;
  dump.header.running_task = 1;
  const auto lines = lines_of(flight_timeline(dump, {.ticks_before = 2}));
  CHECK(lines[0] == "cause: signal 11, running task: cell");
  CHECK(lines.size() == 5 + 3);
}

TEST_CASE("a dump without a whole tick says so") {
  FlightDump dump = four_ticks();
  dump.events.resize(1);
  CHECK(lines_of(flight_timeline(dump, {})).back() == "no whole tick is in this dump");
}
