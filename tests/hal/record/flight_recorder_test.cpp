// The flight recorder: what its ring keeps, when it freezes, and that its file says the same.
#include "hal/record/flight_recorder.hpp"

#include "hal/temporary_folder.hpp"

#include <doctest/doctest.h>

#include <csignal>
#include <fcntl.h>
#include <filesystem>
#include <fstream>
#include <sys/wait.h>
#include <unistd.h>

using namespace moldloft::hal;
using namespace std::chrono_literals;

namespace {

EventRecord event_at(Instant at, std::string_view source, std::string_view event) {
  return {.at = at, .source = source, .event = event, .from = "here", .to = "there"};
}

FlightDump dumped(const FlightRecorder& flight) {
  const TemporaryFolder folder;
  const std::string path = folder.file("flight.bin");
  const int file = ::open(path.c_str(), O_WRONLY | O_CREAT, 0600);
  REQUIRE(file >= 0);
  REQUIRE(flight.dump(file));
  ::close(file);
  auto dump = read_flight_dump(path);
  REQUIRE_MESSAGE(dump.has_value(), dump.error().what);
  return *dump;
}

std::string refusal(const std::string& path) {
  const auto dump = read_flight_dump(path);
  return dump ? "" : dump.error().what;
}

}  // namespace

TEST_CASE("a dump holds names, events and transitions, oldest first") {
  FlightRecorder flight{{.events = 16, .transitions = 4}};
  flight.name(0, "scanner in");
  flight.name(100, "a name that is longer than its field");
  flight.tick(1ms, 7us, 0);
  flight.note(FlightKind::task, 0, 1007us, 12us);
  flight.bytes(FlightKind::received, 1, 1010us, 33);
  flight.note(FlightKind::background, 100, 1100us, 150us);
  flight.transition(event_at(1012us, "cell", "start"));

  const FlightDump dump = dumped(flight);
  CHECK(dump.header.cause == FlightCause::none);
  CHECK(dump.name_of(0) == "scanner in");
  CHECK(dump.name_of(100) == "a name that is longer th");
  CHECK(dump.name_of(255) == "none");
  REQUIRE(dump.events.size() == 4);
  CHECK(dump.events[0].kind == FlightKind::tick);
  CHECK(dump.events[0].at_ns == 1'000'000);
  CHECK(dump.events[0].value == 7'000);
  CHECK(dump.events[1].kind == FlightKind::task);
  CHECK(dump.events[1].value == 12'000);
  CHECK(dump.events[2].kind == FlightKind::received);
  CHECK(dump.events[2].id == 1);
  CHECK(dump.events[2].value == 33);
  CHECK(dump.events[3].id == 100);
  REQUIRE(dump.transitions.size() == 1);
  CHECK(flight_text(dump.transitions[0].source) == "cell");
  CHECK(flight_text(dump.transitions[0].event) == "start");
  CHECK(flight_text(dump.transitions[0].to) == "there");
}

TEST_CASE("the ring keeps the last events, each exactly once and in order") {
  FlightRecorder flight{{.events = 8, .transitions = 3}};
  for (int i = 0; i < 21; ++i) flight.note(FlightKind::task, i % 5, Instant{i}, Duration{i * 10});
  for (int i = 0; i < 7; ++i) flight.transition(event_at(Instant{i}, "cell", std::to_string(i)));
  const FlightDump dump = dumped(flight);
  REQUIRE(dump.events.size() == 8);
  for (std::size_t i = 0; i < 8; ++i) {
    CHECK(dump.events[i].at_ns == static_cast<std::int64_t>(13 + i));
    CHECK(dump.events[i].value == (13 + i) * 10);
  }
  REQUIRE(dump.transitions.size() == 3);
  CHECK(flight_text(dump.transitions[0].event) == "4");
  CHECK(flight_text(dump.transitions[2].event) == "6");
}

TEST_CASE("a trigger freezes the ring after the ticks that show what came of it") {
  FlightRecorder flight{{.events = 64, .transitions = 4, .ticks_after = 3, .dumps = 4}};
  std::uint64_t number = 41;
  const auto tick = [&] { flight.tick(std::chrono::milliseconds{number}, 1us, number), ++number; };
  tick();
  flight.trigger(FlightCause::overrun, 2, 41500us);
  CHECK(flight.due());
  for (int i = 0; i < 3; ++i) tick();
  CHECK_FALSE(flight.frozen());
  tick();
  CHECK(flight.frozen());
  tick();  // not kept any more
  flight.transition(event_at(50ms, "cell", "late"));
  const FlightDump dump = dumped(flight);
  CHECK(dump.header.cause == FlightCause::overrun);
  CHECK(dump.header.task == 2);
  CHECK(dump.header.tick == 41);
  CHECK(dump.header.triggered_ns == 41'500'000);
  CHECK(dump.events.size() == 5);
  CHECK(dump.transitions.empty());
  flight.thaw();
  CHECK_FALSE(flight.due());
  tick();
  CHECK(dumped(flight).events.size() == 6);
}

TEST_CASE("while one trigger is worked on others only count, and after the last dump none does anything") {
  FlightRecorder flight{{.events = 64, .transitions = 4, .ticks_after = 0, .dumps = 2}};
  for (int dump = 0; dump < 2; ++dump) {
    flight.trigger(FlightCause::abort, 1, 1ms);
    flight.trigger(FlightCause::overrun, 3, 2ms);
    flight.tick(3ms, 0us, 3);
    CHECK(flight.frozen());
    CHECK(dumped(flight).header.cause == FlightCause::abort);  // the first one stands
    CHECK(dumped(flight).header.task == 1);
    flight.thaw();
  }
  CHECK(flight.later_triggers() == 2);
  CHECK(flight.dumps_left() == 0);
  flight.trigger(FlightCause::abort, 1, 5ms);
  CHECK_FALSE(flight.due());
}

TEST_CASE("overruns and missed ticks are dumped once in a while, and leave two dumps for what is worse") {
  FlightRecorder flight{{.events = 64, .transitions = 4, .ticks_after = 0, .dumps = 4, .quiet = 2s}};
  const auto dumps_at = [&](Instant at, FlightCause cause) {
    flight.trigger(cause, 0, at);
    flight.tick(at, 0us, 0);
    const bool frozen = flight.frozen();
    if (frozen) flight.thaw();
    return frozen;
  };
  CHECK(dumps_at(1s, FlightCause::overrun));
  CHECK_FALSE(dumps_at(2s, FlightCause::missed_tick));
  CHECK_FALSE(dumps_at(3s - 1ns, FlightCause::overrun));
  CHECK(dumps_at(3s, FlightCause::missed_tick));
  CHECK(flight.later_triggers() == 2);
  CHECK_FALSE(dumps_at(9s, FlightCause::missed_tick));  // two are left
  CHECK(dumps_at(9s, FlightCause::request));
  CHECK(dumps_at(9s, FlightCause::abort));
  CHECK(flight.dumps_left() == 0);
}

TEST_CASE("a request from another thread triggers at the next tick") {
  FlightRecorder flight{{.events = 64, .transitions = 4, .ticks_after = 0, .dumps = 2}};
  flight.request();
  CHECK_FALSE(flight.due());
  flight.tick(5ms, 0us, 5);
  CHECK(flight.frozen());
  CHECK(dumped(flight).header.cause == FlightCause::request);
  CHECK(dumped(flight).name_of(dumped(flight).header.task) == "none");
  flight.thaw();
  flight.tick(6ms, 0us, 6);
  CHECK_FALSE(flight.due());  // once
}

TEST_CASE("a value beyond 4.29 seconds stands as the largest, never as a small one") {
  FlightRecorder flight{{.events = 4, .transitions = 1}};
  flight.note(FlightKind::task, 0, 1ms, 5s);
  flight.note(FlightKind::task, 0, 1ms, -1ns);
  const FlightDump dump = dumped(flight);
  CHECK(dump.events[0].value == UINT32_MAX);
  CHECK(dump.events[1].value == 0);
}

TEST_CASE("a crash handler's dump says which signal and which task") {
  const TemporaryFolder folder;
  const std::string path = folder.file("crash.bin");
  const pid_t child = ::fork();
  REQUIRE(child >= 0);
  if (child == 0) {
    static FlightRecorder flight{{.events = 32, .transitions = 2}};
    static std::string where = path;
    flight.name(3, "cell");
    for (int i = 0; i < 40; ++i)
      flight.tick(std::chrono::milliseconds{i}, 2us, static_cast<std::uint64_t>(i));
    std::signal(SIGSEGV, [](int number) {
      const int file = ::open(where.c_str(), O_WRONLY | O_CREAT, 0600);
      ::_exit(flight.dump(file, FlightCause::signal, 3, number) ? 7 : 8);
    });
    ::raise(SIGSEGV);
    ::_exit(9);
  }
  int status = 0;
  REQUIRE(::waitpid(child, &status, 0) == child);
  REQUIRE(WIFEXITED(status));
  CHECK(WEXITSTATUS(status) == 7);
  const auto dump = read_flight_dump(path);
  REQUIRE_MESSAGE(dump.has_value(), dump.error().what);
  CHECK(dump->header.cause == FlightCause::signal);
  CHECK(dump->header.signal == SIGSEGV);
  CHECK(dump->name_of(dump->header.running_task) == "cell");
  CHECK(dump->events.size() == 32);
  CHECK(dump->events.front().at_ns == 8'000'000);
}

TEST_CASE("what is no dump, of another layout, cut short or damaged is one line that says so") {
  const TemporaryFolder folder;
  const std::string path = folder.file("flight.bin");
  CHECK(refusal(path) == path + ": cannot be read");
  std::ofstream{path} << "hello";
  CHECK(refusal(path) == path + ": is not a flight recorder's dump");

  FlightRecorder flight{{.events = 8, .transitions = 2}};
  flight.tick(1ms, 1us, 1);
  const int file = ::open(path.c_str(), O_WRONLY | O_TRUNC);
  REQUIRE(flight.dump(file));
  ::close(file);
  CHECK(refusal(path).empty());
  const auto patch = [&](std::streamoff at, char value) {
    std::fstream f{path, std::ios::binary | std::ios::in | std::ios::out};
    f.seekp(at);
    f.put(value);
  };
  std::filesystem::resize_file(path, std::filesystem::file_size(path) - 1);
  CHECK(refusal(path) == path + ": ends early; was the disk full?");
  patch(offsetof(FlightHeader, events) + 3, '\x7f');
  CHECK(refusal(path) == path + ": has a header that cannot be true; the file is damaged");
  patch(offsetof(FlightHeader, version), 9);
  CHECK(refusal(path) == path + ": was written in layout 9, this program reads 1");
  patch(3, 'x');
  CHECK(refusal(path) == path + ": is not a flight recorder's dump");
}

TEST_CASE("a file that takes no more is reported, not ignored") {
  FlightRecorder flight{{.events = 8, .transitions = 2}};
  flight.tick(1ms, 1us, 1);
  const int full = ::open("/dev/full", O_WRONLY);
  REQUIRE(full >= 0);
  CHECK_FALSE(flight.dump(full));
  ::close(full);
  CHECK_FALSE(flight.dump(-1));
}
