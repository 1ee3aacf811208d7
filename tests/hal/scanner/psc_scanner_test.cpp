#include "hal/scanner/psc_scanner.hpp"

#include "hal/base/crc32c.hpp"
#include "hal/driver_bench.hpp"
#include "hal/loss_of.hpp"
#include "hal/scanner_peer.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <cstring>
#include <random>

using namespace moldloft::hal;
using Kind = ScannerEvent::Kind;

namespace {

struct Cell : DriverBench<PscScanner, ScannerPeer, ScannerEvent> {
  explicit Cell(const PscScanner::Settings& settings = {}, double bytes_per_second = 12.5e6)
      : DriverBench{{.bytes_per_second = bytes_per_second}, settings} {}
  PscScanner& scanner = driver;

  const Frame& frame() {
    while (scanner.packed() > 0) scanner.unpack(64);
    return scanner.frame();
  }
};

// What encode, wire and decode do to a frame, without a driver.
Frame through_the_wire(const Frame& frame) {
  std::vector<std::byte> wire(psc1::encoded_frame_size(frame, psc1::Encoding::int16, true));
  psc1::encode_frame(1, frame, psc1::Encoding::int16, true, {51, 51, 40}, wire);
  Frame back{frame.stripe_count, frame.point_count};
  REQUIRE(psc1::decode_frame(std::span{wire}.subspan(32, wire.size() - 36), back));
  return back;
}

bool same_points(const Frame& a, const Frame& b) {
  if (a.point_count != b.point_count || a.stripe_count != b.stripe_count) return false;
  for (std::size_t i = 0; i < a.point_count; ++i) {
    if (a.x[i] != b.x[i] || a.y[i] != b.y[i] || a.z[i] != b.z[i] || a.intensity[i] != b.intensity[i])
      return false;
  }
  return true;
}

// Drops or damages the first `times` messages of a type.
auto damage_first(int times, psc1::Type type, std::size_t at) {
  return [=, left = times](std::vector<std::byte>& message, psc1::Type sent) mutable {
    if (sent == type && left-- > 0) message[at] ^= std::byte{0x10};
    return true;
  };
}

auto drop_first(int times, psc1::Type type) {
  return [=, left = times](std::vector<std::byte>&, psc1::Type sent) mutable {
    return sent != type || left-- <= 0;
  };
}

}  // namespace

TEST_CASE("HELLO, CONFIG, ready, the sensor's figures are known then") {
  Cell cell;
  CHECK(cell.scanner.state() == ScannerState::offline);
  cell.start();
  CHECK(cell.scanner.state() == ScannerState::ready);
  CHECK(cell.scanner.info().sensor.view() == "peer");
  CHECK(cell.scanner.info().session_id == 1000);
  CHECK(cell.scanner.info().max_stripes == 10);
  CHECK(cell.scanner.info().max_points == 500);
  CHECK(cell.scanner.info().field_x_mm == 102);
  CHECK(cell.scanner.info().depth_mm == 40);
}

TEST_CASE("a shot: the exposure is reported first, the frame when its last byte is in") {
  Cell cell;
  cell.start();
  const Instant asked = cell.clock.now();
  CHECK_FALSE(cell.scanner.trigger(0, asked));
  REQUIRE(cell.scanner.trigger(17, asked));
  CHECK(cell.scanner.state() == ScannerState::exposing);
  CHECK_FALSE(cell.scanner.trigger(18, asked));
  REQUIRE(cell.run_until(Kind::exposed));
  CHECK(cell.clock.now() - asked <= 5ms);
  CHECK(cell.scanner.state() == ScannerState::computing);
  REQUIRE(cell.run_until(Kind::frame));
  CHECK(cell.clock.now() - asked <= 110ms);
  CHECK(cell.scanner.state() == ScannerState::ready);
  CHECK(cell.events.back().shot_id == 17);
  CHECK(cell.scanner.frame().shot_id == 17);
  CHECK(cell.scanner.frame().exposed_sensor_ns == 17'000'000);
  CHECK(same_points(cell.frame(), through_the_wire(sample_frame(10, 50, 17, 1000))));
  CHECK(cell.scanner.frame_bytes() == 48 + 10 * 12 + 500 * 7);
  CHECK(cell.peer.triggers == std::vector<std::uint32_t>{17});
}

TEST_CASE("where the payload lies in all bytes received is known, across connections") {
  Cell cell;
  cell.start();
  constexpr std::uint64_t greeting = (32 + 48 + 4) + (32 + 8 + 4);
  constexpr std::uint64_t exposed = 32 + 12 + 4;
  REQUIRE(cell.scanner.trigger(1, cell.clock.now()));
  REQUIRE(cell.run_until(Kind::frame));
  CHECK(cell.scanner.frame_offset() == greeting + exposed + 32);
  const std::uint64_t first_life = cell.scanner.frame_offset() + cell.scanner.frame_bytes() + 4;
  cell.cable.cut();
  cell.run(10ms);
  cell.cable.mend();
  REQUIRE(cell.run_until(Kind::ready));
  REQUIRE(cell.scanner.trigger(2, cell.clock.now()));
  REQUIRE(cell.run_until(Kind::frame));
  CHECK(cell.scanner.frame_offset() == first_life + greeting + exposed + 32);
}

TEST_CASE("a frame is unpacked in pieces of any size, and its lines are known before its points") {
  const Frame truth = through_the_wire(sample_frame(10, 50, 3, 1000));
  for (const std::size_t piece : {1u, 7u, 16u, 100u, 499u, 500u, 501u}) {
    CAPTURE(piece);
    Cell cell;
    cell.start();
    REQUIRE(cell.scanner.trigger(3, cell.clock.now()));
    REQUIRE(cell.run_until(Kind::frame));
    CHECK(cell.scanner.frame().point_count == 500);
    CHECK(cell.scanner.frame().lines().size() == 10);
    std::size_t calls = 0;
    for (; cell.scanner.unpacked() < 500; ++calls) cell.scanner.unpack(piece);
    CHECK(calls == (500 + piece - 1) / piece);
    CHECK(same_points(cell.scanner.frame(), truth));
    CHECK(cell.scanner.packed() == 0);
  }
}

TEST_CASE("the driver unpacks by itself where nobody asks, and reads no byte over what is still packed") {
  Cell cell{{.points_a_tick = 20}};
  cell.start();
  REQUIRE(cell.scanner.trigger(3, cell.clock.now()));
  REQUIRE(cell.run_until(Kind::frame));
  const Frame truth = through_the_wire(sample_frame(10, 50, 3, 1000));
  CHECK_FALSE(same_points(cell.scanner.frame(), truth));
  // 500 points at 20 a tick; the next shot is asked for meanwhile and its frame comes after them.
  REQUIRE(cell.scanner.trigger(4, cell.clock.now()));
  const Instant from = cell.clock.now();
  while (cell.clock.now() < from + 24ms) cell.tick();
  CHECK_FALSE(same_points(cell.scanner.frame(), truth));
  cell.tick();
  cell.tick();
  CHECK(same_points(cell.scanner.frame(), truth));
  REQUIRE(cell.run_until(Kind::frame));
  CHECK(cell.scanner.frame().shot_id == 4);
  CHECK(same_points(cell.frame(), through_the_wire(sample_frame(10, 50, 4, 1000))));
  CHECK(loss_of(cell.scanner, "broken streams") == 0);
}

TEST_CASE("a frame can be looked at while it arrives: its points are there before its last byte") {
  for (const auto encoding : {psc1::Encoding::int16, psc1::Encoding::float32}) {
    Cell cell{{.encoding = encoding}, 40e3};  // 40 bytes a tick
    cell.start();
    REQUIRE(cell.scanner.trigger(3, cell.clock.now()));
    REQUIRE(cell.run_until(Kind::arriving));
    CHECK(cell.events.back().shot_id == 3);
    CHECK(cell.scanner.frame().lines().size() == 10);
    CHECK(cell.scanner.unpacked() == 0);
    CHECK(cell.scanner.packed() > 0);
    CHECK(cell.scanner.packed() <= 20);  // of the first tick of the heights
    Frame truth = sample_frame(10, 50, 3, 1000);
    if (encoding == psc1::Encoding::int16) truth = through_the_wire(truth);
    std::size_t seen = 0;
    while (seen < 500 && cell.count(Kind::frame) == 0) {
      while (cell.scanner.packed() > 0) cell.scanner.unpack(7);
      for (; seen < cell.scanner.unpacked(); ++seen) REQUIRE(cell.scanner.frame().z[seen] == truth.z[seen]);
      cell.tick();
    }
    CHECK(seen == 500);
    CHECK(cell.count(Kind::frame) == 0);  // the intensities are still on their way
    REQUIRE(cell.run_until(Kind::frame));
    CHECK(cell.scanner.packed() == 0);
    CHECK(same_points(cell.scanner.frame(), truth));
    CHECK(cell.count(Kind::arriving) == 1);
  }
}

TEST_CASE("what arrives is taken back when its CRC turns out wrong, and begins anew with the next attempt") {
  Cell cell{{}, 40e3};
  cell.start();
  cell.peer.on_send = damage_first(1, psc1::Type::frame, 32 + 48 + 120 + 3499);  // in the last intensity
  REQUIRE(cell.scanner.trigger(5, cell.clock.now()));
  REQUIRE(cell.run_until(Kind::arriving));
  while (cell.count(Kind::lost) == 0) {
    cell.scanner.unpack(500);
    REQUIRE(cell.count(Kind::frame) == 0);
    cell.tick();
  }
  CHECK(cell.scanner.unpacked() == 0);
  CHECK(cell.scanner.packed() == 0);
  REQUIRE(cell.run_until(Kind::arriving));
  CHECK(cell.scanner.unpacked() == 0);
  REQUIRE(cell.run_until(Kind::frame));
  CHECK(same_points(cell.frame(), through_the_wire(sample_frame(10, 50, 5, 1000))));
  CHECK(cell.peer.exposures == 1);
}

TEST_CASE("a frame that comes in one piece is not announced first, one that nobody waits for not at all") {
  Cell fast;
  fast.start();
  REQUIRE(fast.scanner.trigger(5, fast.clock.now()));
  REQUIRE(fast.run_until(Kind::frame));
  CHECK(fast.count(Kind::arriving) == 0);

  Cell slow{{}, 40e3};
  slow.start();
  REQUIRE(slow.scanner.trigger(5, slow.clock.now()));
  REQUIRE(slow.run_until(Kind::exposed));
  slow.peer.send_frame(4, 1000);  // another shot's
  slow.peer.send_frame(5, 999);   // another session's
  REQUIRE(slow.run_until(Kind::arriving));
  CHECK(loss_of(slow.scanner, "stale frames") == 2);
  slow.scanner.forget_shot();
  CHECK(slow.scanner.packed() == 0);
  REQUIRE(slow.scanner.trigger(6, slow.clock.now()));
  REQUIRE(slow.run_until(Kind::frame));
  CHECK(loss_of(slow.scanner, "stale frames") == 3);
  CHECK(slow.count(Kind::arriving) == 2);
  CHECK(slow.scanner.frame().shot_id == 6);
  CHECK(same_points(slow.frame(), through_the_wire(sample_frame(10, 50, 6, 1000))));
}

TEST_CASE("a stream in pieces of any size gives the same frame") {
  const Frame truth = through_the_wire(sample_frame(10, 50, 3, 1000));
  for (const std::size_t budget : {32u, 33u, 57u, 101u, 1460u, 4096u, 65536u}) {
    for (const double rate : {40e3, 12.5e6}) {
      CAPTURE(budget);
      CAPTURE(rate);
      Cell cell{{.bytes_a_tick = budget}, rate};
      cell.start();
      REQUIRE(cell.scanner.trigger(3, cell.clock.now()));
      REQUIRE(cell.run_until(Kind::frame));
      CHECK(same_points(cell.frame(), truth));
      CHECK(loss_of(cell.scanner, "broken streams") == 0);
    }
  }
}

TEST_CASE("one receive() takes no more than its budget") {
  Cell cell{{.bytes_a_tick = 1000}};
  cell.start();
  cell.peer.processing_time = 0ms;
  REQUIRE(cell.scanner.trigger(3, cell.clock.now()));
  REQUIRE(cell.run_until(Kind::exposed));
  int ticks = 0;
  for (; cell.count(Kind::frame) == 0 && ticks < 100; ++ticks) cell.tick();
  CHECK(ticks >= (32 + 48 + 120 + 3500 + 4) / 1000);
}

TEST_CASE("a frame with a wrong CRC drops the connection, the same shot comes again, exposed once") {
  for (const std::size_t at :
       {0u, 9u, 25u, 40u, 200u, 3000u}) {  // magic, length, header CRC, head, table, columns
    CAPTURE(at);
    Cell cell;
    cell.start();
    cell.peer.on_send = damage_first(1, psc1::Type::frame, at);
    REQUIRE(cell.scanner.trigger(5, cell.clock.now()));
    REQUIRE(cell.run_until(Kind::frame));
    CHECK(loss_of(cell.scanner, "broken streams") == 1);
    CHECK(cell.peer.exposures == 1);
    CHECK(cell.peer.hellos == 2);
    CHECK(cell.peer.configs == 2);
    CHECK(cell.peer.triggers == std::vector<std::uint32_t>{5, 5});
    CHECK(cell.count(Kind::exposed) == 1);  // the arm was free to go the first time
    CHECK(cell.count(Kind::lost) == 1);
    CHECK(same_points(cell.frame(), through_the_wire(sample_frame(10, 50, 5, 1000))));
  }
}

TEST_CASE("after two retries the shot has failed, and the next one is as good as new") {
  Cell cell;
  cell.start();
  cell.peer.on_send = damage_first(3, psc1::Type::frame, 500);
  REQUIRE(cell.scanner.trigger(5, cell.clock.now()));
  REQUIRE(cell.run_until(Kind::shot_failed));
  CHECK(cell.events.back().shot_id == 5);
  CHECK(cell.events.back().text.view() == "message from the scanner: payload CRC wrong");
  CHECK(cell.peer.triggers.size() == 3);
  CHECK(cell.scanner.state() == ScannerState::ready);
  REQUIRE(cell.scanner.trigger(6, cell.clock.now()));
  REQUIRE(cell.run_until(Kind::frame));
  CHECK(cell.scanner.frame().shot_id == 6);
}

TEST_CASE("a frame that does not come is asked for again on the same connection") {
  Cell cell;
  cell.start();
  cell.peer.on_send = drop_first(1, psc1::Type::frame);
  const Instant asked = cell.clock.now();
  REQUIRE(cell.scanner.trigger(5, asked));
  REQUIRE(cell.run_until(Kind::frame));
  CHECK(cell.clock.now() - asked >= 2s);
  CHECK(cell.clock.now() - asked <= 2050ms);
  CHECK(cell.peer.exposures == 1);
  CHECK(cell.peer.hellos == 1);
}

TEST_CASE("an EXPOSED that does not come: the arm is held until it has been said") {
  Cell cell;
  cell.start();
  cell.peer.on_send = [&](std::vector<std::byte>&, psc1::Type type) {
    const bool of_a_shot = type == psc1::Type::exposed || type == psc1::Type::frame;
    return !of_a_shot || cell.peer.triggers.size() > 1;
  };
  REQUIRE(cell.scanner.trigger(5, cell.clock.now()));
  cell.run(900ms);
  CHECK(cell.scanner.state() == ScannerState::exposing);
  REQUIRE(cell.run_until(Kind::frame));
  CHECK(cell.count(Kind::exposed) == 1);
  CHECK(cell.peer.exposures == 1);
}

TEST_CASE("frames of another shot, of another session, or come twice are dropped") {
  Cell cell;
  cell.start();
  cell.peer.send_frame(4, 1000);
  REQUIRE(cell.scanner.trigger(5, cell.clock.now()));
  REQUIRE(cell.run_until(Kind::exposed));
  cell.peer.send_frame(4, 1000);
  cell.peer.send_frame(5, 999);
  REQUIRE(cell.run_until(Kind::frame));
  CHECK(cell.scanner.frame().session_id == 1000);
  const std::uint64_t offset = cell.scanner.frame_offset();
  cell.peer.send_frame(5, 1000);
  cell.run(1s);
  CHECK(cell.count(Kind::frame) == 1);
  CHECK(loss_of(cell.scanner, "stale frames") == 4);
  CHECK(cell.scanner.frame_offset() == offset);
  CHECK(cell.scanner.frame().shot_id == 5);
}

TEST_CASE("a shot that the cell forgets leaves no trace") {
  Cell cell;
  cell.start();
  REQUIRE(cell.scanner.trigger(5, cell.clock.now()));
  REQUIRE(cell.run_until(Kind::exposed));
  cell.scanner.forget_shot();
  CHECK(cell.scanner.state() == ScannerState::ready);
  REQUIRE(cell.scanner.trigger(6, cell.clock.now()));  // while the sensor still computes: it says BUSY
  REQUIRE(cell.run_until(Kind::frame));
  CHECK(cell.scanner.frame().shot_id == 6);
  CHECK(cell.count(Kind::shot_failed) == 0);  // being asked to wait is no failure
}

TEST_CASE("a heartbeat a second, a scanner that is silent for three is lost, and found again") {
  Cell cell;
  cell.start();
  cell.run(10s + 5ms);
  CHECK(cell.peer.pings == 10);
  cell.peer.mute = true;
  const Instant muted = cell.clock.now();
  REQUIRE(cell.run_until(Kind::lost));
  CHECK(cell.clock.now() - muted >= 2s);  // its last answer came up to a second before
  CHECK(cell.clock.now() - muted <= 3010ms);
  CHECK(cell.scanner.state() == ScannerState::offline);
  CHECK(cell.scanner.why().starts_with("the scanner has been silent for 300"));
  cell.run(20s);
  CHECK(cell.count(Kind::lost) == 1);
  cell.peer.mute = false;
  REQUIRE(cell.run_until(Kind::ready, 4s));
}

TEST_CASE("a link that is gone is tried again after 100 ms, 200 ms, 400 ms, and every 2 s in the end") {
  Cell cell;
  cell.start();
  cell.cable.cut();
  REQUIRE(cell.run_until(Kind::lost, 5ms));
  cell.run(650ms);  // the attempts at 100 and 300 ms have failed, the next is at 700
  cell.cable.mend();
  Instant mended = cell.clock.now();
  REQUIRE(cell.run_until(Kind::ready));
  CHECK(cell.clock.now() - mended < 100ms);
  cell.cable.cut();
  cell.run(60s);
  cell.cable.mend();
  mended = cell.clock.now();
  REQUIRE(cell.run_until(Kind::ready));
  CHECK(cell.clock.now() - mended < 2010ms);
}

TEST_CASE(
    "the sensor restarts between EXPOSED and FRAME: the shot fails, it is not exposed from another place") {
  Cell cell;
  cell.start();
  REQUIRE(cell.scanner.trigger(5, cell.clock.now()));
  REQUIRE(cell.run_until(Kind::exposed));
  cell.peer.reboot(1001);
  REQUIRE(cell.run_until(Kind::shot_failed));
  CHECK(cell.peer.exposures == 1);
  CHECK(cell.peer.triggers.size() == 1);
  CHECK(cell.scanner.info().session_id == 1001);
  REQUIRE(cell.scanner.trigger(6, cell.clock.now()));
  REQUIRE(cell.run_until(Kind::frame));
}

TEST_CASE("the sensor restarts before EXPOSED: the arm still stands, the shot is taken in the new session") {
  Cell cell;
  cell.peer.exposure_time = 50ms;
  cell.start();
  REQUIRE(cell.scanner.trigger(5, cell.clock.now()));
  cell.run(10ms);
  cell.peer.reboot(1001);
  REQUIRE(cell.run_until(Kind::frame));
  CHECK(cell.scanner.frame().session_id == 1001);
  CHECK(cell.peer.exposures == 1);
}

TEST_CASE("a sensor that lost the stored frame and exposes again is not believed") {
  Cell cell;
  cell.start();
  cell.peer.on_send = drop_first(1, psc1::Type::frame);
  REQUIRE(cell.scanner.trigger(5, cell.clock.now()));
  REQUIRE(cell.run_until(Kind::exposed));
  cell.peer.on_send = [](std::vector<std::byte>&, psc1::Type type) { return type != psc1::Type::frame; };
  cell.run(1990ms);
  cell.peer.on_send = [&](std::vector<std::byte>& message, psc1::Type type) {
    if (type == psc1::Type::exposed) psc1::encode(99, psc1::Exposed{5, 1000, false}, 0, message);
    return true;
  };
  REQUIRE(cell.run_until(Kind::shot_failed));
  cell.run(1s);
  CHECK(cell.count(Kind::frame) == 0);
}

TEST_CASE("a shot id that an earlier run has used does not bring that run's picture") {
  Cell cell;
  cell.start();
  REQUIRE(cell.scanner.trigger(1, cell.clock.now()));
  REQUIRE(cell.run_until(Kind::frame));
  PscScanner next_run{cell.cable.host(), {}};
  next_run.start(cell.clock.now());
  const auto run = [&] {
    next_run.receive(cell.clock.now());
    next_run.transmit(cell.clock.now());
    cell.peer.step();
    cell.clock.sleep_until(cell.clock.now() + 1ms);
    return next_run.next_event();
  };
  std::optional<ScannerEvent> event;
  for (int i = 0; i < 100 && !event; ++i) event = run();
  REQUIRE(next_run.trigger(1, cell.clock.now()));
  event.reset();
  for (int i = 0; i < 1000 && !event; ++i) event = run();
  REQUIRE(event);
  CHECK(event->kind == Kind::shot_failed);
}

TEST_CASE(
    "an error of the sensor costs an attempt, a sensor that forgot its configuration is greeted again") {
  Cell cell;
  cell.start();
  cell.peer.exposure_time = 1h;
  REQUIRE(cell.scanner.trigger(5, cell.clock.now()));
  for (int i = 0; i < 3; ++i) {
    cell.run(5ms);
    cell.peer.reply(
        psc1::ErrorReply{.status = psc1::Status::sensor_fault, .shot_id = 5, .text = "laser too warm"},
        psc1::Type::error);
  }
  REQUIRE(cell.run_until(Kind::shot_failed));
  CHECK(cell.events.back().text.view() == "scanner: laser too warm (SENSOR_FAULT, status 5)");
  cell.peer.reply(psc1::ErrorReply{.status = psc1::Status::bad_state}, psc1::Type::error);
  REQUIRE(cell.run_until(Kind::ready));
  CHECK(cell.peer.hellos == 2);
}

TEST_CASE("whatever bytes arrive, the driver stays in its table and comes back") {
  std::mt19937 random{6};
  Cell cell;
  cell.start();
  for (int round = 0; round < 200; ++round) {
    std::vector<std::byte> noise(random() % 300);
    for (auto& byte : noise) byte = static_cast<std::byte>(random());
    if (round % 2 == 0 && noise.size() >= 36) {  // a good header in front of nonsense
      psc1::encode_header({.type = static_cast<psc1::Type>(1 + random() % 9),
                           .payload_length = static_cast<std::uint32_t>(noise.size() - 36)},
                          std::span{noise}.first<32>());
      const auto crc = crc32c(std::span{noise}.subspan(32, noise.size() - 36));
      std::memcpy(noise.data() + noise.size() - 4, &crc, 4);
    }
    cell.peer.send(noise);
    cell.run(20ms);
  }
  cell.run(10s);
  CHECK(loss_of(cell.scanner, "broken streams") > 20);
  CHECK(cell.scanner.state() == ScannerState::ready);
  REQUIRE(cell.scanner.trigger(5, cell.clock.now()));
  REQUIRE(cell.run_until(Kind::frame));
}
