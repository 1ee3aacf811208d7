#include "hal/record/recorder.hpp"

#include "hal/links/cable.hpp"
#include "hal/record/run_store.hpp"
#include "hal/record/tapped_link.hpp"
#include "hal/scanner/psc_scanner.hpp"
#include "hal/scanner_peer.hpp"
#include "hal/temporary_folder.hpp"

#include <doctest/doctest.h>
#include <sqlite3.h>

#include <algorithm>
#include <atomic>
#include <thread>

using namespace moldloft::hal;

namespace {

RunStore new_store(const TemporaryFolder& folder) {
  auto store = RunStore::open(folder.file("run.db"), RunStore::Mode::create);
  REQUIRE(store);
  return std::move(*store);
}

std::vector<std::byte> block(std::size_t count, int value) {
  return std::vector<std::byte>(count, static_cast<std::byte>(value));
}

constexpr auto scanner = LinkId::scanner;
constexpr auto received = Direction::received;

}  // namespace

TEST_CASE("bytes, events and shots come into the store, offsets count each link and direction for itself") {
  const TemporaryFolder folder;
  RunStore store = new_store(folder);
  Recorder recorder{{}};
  recorder.link_bytes(scanner, received, 1ms, block(10, 1));
  recorder.link_bytes(LinkId::robot, Direction::sent, 2ms, block(5, 2));
  recorder.link_bytes(scanner, received, 3ms, block(20, 3));
  recorder.event({.at = 4ms, .source = "cell", .event = "go", .text = ""});
  recorder.shot({.at = 5ms, .shot_id = 7, .payload_offset = 10, .payload_bytes = 20});
  CHECK(recorder.offset(scanner, received) == 30);
  CHECK(recorder.offset(LinkId::robot, Direction::sent) == 5);
  CHECK(recorder.offset(LinkId::robot, received) == 0);
  REQUIRE(recorder.drain(store));
  CHECK(store.bytes(scanner, received, 5, 10)->at(4) == std::byte{1});
  CHECK(store.bytes(scanner, received, 5, 10)->at(5) == std::byte{3});
  CHECK(store.bytes(LinkId::robot, Direction::sent, 0, 5)->size() == 5);
  CHECK(store.events()->size() == 1);
  CHECK(store.shots()->front().shot_id == 7);
  CHECK(recorder.lost() == 0);
  REQUIRE(recorder.drain(store));  // nothing new: nothing twice
  CHECK(store.events()->size() == 1);
}

TEST_CASE("a full ring drops and counts, the offsets of what follows stay right") {
  const TemporaryFolder folder;
  RunStore store = new_store(folder);
  Recorder recorder{{.bulk_bytes = 1000, .events_bytes = 4096, .largest_frame_bytes = 100}};
  recorder.link_bytes(scanner, received, 1ms, block(600, 1));
  recorder.link_bytes(scanner, received, 1ms, block(600, 2));  // no room
  CHECK(recorder.lost() == 1);
  CHECK(recorder.offset(scanner, received) == 1200);
  recorder.event({.source = "cell", .event = "still heard", .text = ""});
  REQUIRE(recorder.drain(store));
  recorder.link_bytes(scanner, received, 1ms, block(100, 3));
  REQUIRE(recorder.drain(store));
  CHECK(store.events()->size() == 1);  // bulk did not crowd it out
  CHECK(store.bytes(scanner, received, 1200, 100)->front() == std::byte{3});
  CHECK_FALSE(store.bytes(scanner, received, 600, 1));
  for (int i = 0; i < 100; ++i) recorder.event({.event = "flood", .text = ""});
  CHECK(recorder.lost() > 50);
}

TEST_CASE(
    "there is room for a frame until there is not, and again after the drain, no byte of a frame is lost") {
  const TemporaryFolder folder;
  RunStore store = new_store(folder);
  constexpr std::size_t frame = 100'000;
  Recorder recorder{{.bulk_bytes = 1u << 20, .largest_frame_bytes = frame}};
  int frames = 0;
  while (recorder.room_for_frame()) {
    for (std::size_t i = 0; i < frame; i += 500) recorder.link_bytes(scanner, received, 1ms, block(500, 1));
    ++frames;
  }
  CHECK(frames == 9);  // 200 pieces of 500 bytes take 110,400 bytes; room is asked for 129,096
  CHECK(recorder.lost() == 0);
  CHECK(recorder.high_water_bytes() > 9 * frame);
  CHECK(recorder.high_water_bytes() <= recorder.plan_bytes());
  REQUIRE(recorder.drain(store));
  CHECK(recorder.room_for_frame());
}

TEST_CASE("a store that refuses keeps the records, closes the door for frames, and says why") {
  const TemporaryFolder folder;
  RunStore store = new_store(folder);
  Recorder recorder{{}};
  recorder.event({.event = "first", .text = ""});
  REQUIRE(recorder.drain(store));

  sqlite3* other = nullptr;
  REQUIRE(sqlite3_open(folder.file("run.db").c_str(), &other) == SQLITE_OK);
  REQUIRE(sqlite3_exec(other, "CREATE TRIGGER no BEFORE INSERT ON shots BEGIN SELECT RAISE(ABORT, 'no'); END",
                       nullptr, nullptr, nullptr) == SQLITE_OK);
  recorder.event({.event = "second", .text = ""});
  recorder.shot({.shot_id = 1});
  CHECK_FALSE(recorder.drain(store));
  CHECK(recorder.store_failed());
  CHECK(recorder.store_error().view() == folder.file("run.db") + ": no");
  CHECK_FALSE(recorder.room_for_frame());
  CHECK(store.events()->size() == 1);  // nothing half

  REQUIRE(sqlite3_exec(other, "DROP TRIGGER no", nullptr, nullptr, nullptr) == SQLITE_OK);
  sqlite3_close(other);
  REQUIRE(recorder.drain(store));
  CHECK_FALSE(recorder.store_failed());
  CHECK(recorder.room_for_frame());
  CHECK(store.events()->size() == 2);
  CHECK(store.shots()->size() == 1);
}

TEST_CASE("one thread records, another drains: everything arrives, in order") {
  const TemporaryFolder folder;
  RunStore store = new_store(folder);
  Recorder recorder{{.bulk_bytes = 64u << 10, .events_bytes = 64u << 10, .largest_frame_bytes = 4096}};
  constexpr int shots = 300;
  std::atomic<bool> done{false};
  std::atomic<bool> all_drained{true};
  std::thread disk{[&] {
    while (!done.load()) {
      if (!recorder.drain(store)) all_drained = false;
      std::this_thread::yield();
    }
    if (!recorder.drain(store)) all_drained = false;
  }};
  for (int i = 0; i < shots;) {
    if (!recorder.room_for_frame()) {
      std::this_thread::yield();
      continue;
    }
    const std::uint64_t offset = recorder.offset(scanner, received);
    for (int piece = 0; piece < 4; ++piece)
      recorder.link_bytes(scanner, received, Instant{i}, block(1000, i));
    recorder.shot({.at = Instant{i},
                   .shot_id = static_cast<std::uint32_t>(i),
                   .payload_offset = offset,
                   .payload_bytes = 4000});
    recorder.event({.at = Instant{i}, .event = "shot", .text = recorder.store_error()});
    ++i;
  }
  done = true;
  disk.join();
  CHECK(all_drained);
  CHECK(recorder.lost() == 0);
  CHECK(store.events()->size() == shots);
  const auto stored = store.shots();
  REQUIRE(stored->size() == shots);
  for (const auto& shot : *stored) {
    const auto bytes = store.bytes(scanner, received, shot.payload_offset, shot.payload_bytes);
    REQUIRE(bytes);
    REQUIRE(std::ranges::count(*bytes, static_cast<std::byte>(shot.shot_id)) == 4000);
  }
}

TEST_CASE(
    "driver, tap, recorder and store together: the frame in the store is the frame that the driver gave") {
  const TemporaryFolder folder;
  RunStore store = new_store(folder);
  VirtualClock clock;
  Cable cable{clock, {.bytes_per_second = 0.5e6}};  // slow enough for a frame to come in pieces
  Recorder recorder{{}};
  TappedLink link{cable.host(), scanner, recorder, clock};
  ScannerPeer peer{cable.device(), clock};
  PscScanner driver{link, {}};
  const auto run_until = [&](ScannerEvent::Kind kind) {
    for (int i = 0; i < 5000; ++i) {
      driver.receive(clock.now());
      driver.transmit(clock.now());
      peer.step();
      clock.sleep_until(clock.now() + 1ms);
      while (const auto event = driver.next_event()) {
        if (event->kind == kind) return true;
      }
    }
    return false;
  };
  driver.start(clock.now());
  REQUIRE(run_until(ScannerEvent::Kind::ready));
  for (std::uint32_t id = 1; id <= 3; ++id) {
    if (id == 2) {  // another connection: offsets go on
      cable.cut();
      REQUIRE(run_until(ScannerEvent::Kind::lost));
      cable.mend();
      REQUIRE(run_until(ScannerEvent::Kind::ready));
    }
    REQUIRE(driver.trigger(id, clock.now()));
    REQUIRE(run_until(ScannerEvent::Kind::frame));
    const ShotRecord shot{.at = clock.now(),
                          .shot_id = id,
                          .payload_offset = driver.frame_offset(),
                          .payload_bytes = driver.frame_bytes()};
    recorder.shot(shot);
    REQUIRE(recorder.drain(store));
    const auto frame = store.frame(store.shots()->back(), psc1::frame_codec);
    REQUIRE(frame);
    CHECK(frame->shot_id == id);
    driver.unpack(frame->point_count);
    REQUIRE(driver.unpacked() == frame->point_count);
    CHECK(frame->exposed_sensor_ns == driver.frame().exposed_sensor_ns);
    CHECK(std::ranges::equal(frame->z, std::span{driver.frame().z}.first(frame->point_count)));
  }
}
