// The control thread's promise: after construction, receive, transmit, trigger, move and record touch the
// heap not once.
#include "hal/links/cable.hpp"
#include "hal/links/tcp_link.hpp"
#include "hal/loopback_server.hpp"
#include "hal/record/recorder.hpp"
#include "hal/record/tapped_link.hpp"
#include "hal/robot/line_robot.hpp"
#include "hal/robot_peer.hpp"
#include "hal/scanner/psc_scanner.hpp"
#include "hal/scanner_peer.hpp"

#include <doctest/doctest.h>

#include <atomic>
#include <cstdlib>
#include <new>

namespace {

// Counted only while the code under test runs: the peers of the tests may do as they like.
thread_local bool counting = false;
thread_local long allocations = 0;

void* counted(std::size_t size, std::size_t alignment) {
  if (counting) ++allocations;
  size = (size + alignment - 1) / alignment * alignment;
  void* memory = std::aligned_alloc(alignment, size == 0 ? alignment : size);
  if (memory == nullptr) throw std::bad_alloc{};
  return memory;
}

}  // namespace

void* operator new(std::size_t size) { return counted(size, alignof(std::max_align_t)); }
void* operator new[](std::size_t size) { return counted(size, alignof(std::max_align_t)); }
void* operator new(std::size_t size, std::align_val_t alignment) {
  return counted(size, static_cast<std::size_t>(alignment));
}
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete[](void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }
void operator delete[](void* memory, std::size_t) noexcept { std::free(memory); }
void operator delete(void* memory, std::align_val_t) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t, std::align_val_t) noexcept { std::free(memory); }

using namespace moldloft::hal;

namespace {

template <typename F>
void without_heap(F&& work) {
  counting = true;
  work();
  counting = false;
}

}  // namespace

TEST_CASE("the counter counts") {
  allocations = 0;
  without_heap([] { operator delete(operator new(8)); });
  CHECK(allocations == 1);
}

TEST_CASE("both drivers, tapped and recorded, through shots, motions, damage and reconnects: no heap") {
  VirtualClock clock;
  Recorder recorder{{}};
  Cable scanner_cable{clock, {}};
  Cable robot_cable{clock, {.capacity_bytes = 4096, .bytes_per_second = 11520}};
  TappedLink scanner_link{scanner_cable.host(), LinkId::scanner, recorder, clock};
  TappedLink robot_link{robot_cable.host(), LinkId::robot, recorder, clock};
  ScannerPeer scanner_peer{scanner_cable.device(), clock};
  RobotPeer robot_peer{robot_cable.device(), clock};
  PscScanner scanner{scanner_link, {}};
  LineRobot robot{robot_link, {}};
  int frames = 0;
  int motions = 0;
  std::uint32_t shot_id = 0;
  allocations = 0;
  without_heap([&] {
    scanner.start(clock.now());
    robot.start(clock.now());
  });
  for (int tick = 0; tick < 30'000; ++tick) {
    const Instant now = clock.now();
    without_heap([&] {
      scanner.receive(now);
      robot.receive(now);
      while (const auto event = scanner.next_event()) {
        if (event->kind == ScannerEvent::Kind::frame) {
          ++frames;
          recorder.shot({.shot_id = event->shot_id, .payload_offset = scanner.frame_offset()});
        }
        recorder.event({.at = now, .source = "scanner", .text = event->text});
      }
      while (const auto event = robot.next_event()) {
        if (event->kind == RobotEvent::Kind::done) ++motions;
        if (event->kind == RobotEvent::Kind::fault) robot.reset(now);
        recorder.event({.at = now, .source = "robot", .text = event->text});
      }
      scanner.trigger(++shot_id, now);
      robot.move({.x_mm = 0.001 * tick, .z_mm = 100, .pitch = 3}, 50, now);
      scanner.transmit(now);
      robot.transmit(now);
    });
    scanner_peer.on_send = [&](std::vector<std::byte>& message, psc1::Type) {
      if (tick % 1000 == 0) message.back() ^= std::byte{1};
      return true;
    };
    robot_peer.on_reply = [&](std::string& line) {
      if (tick % 100 == 0) line[2] ^= 1;
      return true;
    };
    if (tick == 10'000) scanner_cable.cut();
    if (tick == 12'000) robot_peer.press_emergency_stop();
    if (tick == 12'100) robot_peer.release_emergency_stop();
    if (tick == 14'000) robot_cable.cut();
    if (tick == 15'000) scanner_cable.mend();
    if (tick == 16'000) robot_cable.mend();
    if (tick == 20'000) robot_peer.reboot();
    scanner_peer.step();
    robot_peer.step();
    clock.sleep_until(now + 1ms);
  }
  CHECK(allocations == 0);
  CHECK(frames > 100);
  CHECK(motions > 50);
}

TEST_CASE(
    "a TCP link that is open reads, writes, looks and loses itself without the heap, so it does when it "
    "opens again") {
  LoopbackServer server;
  const auto link = make_tcp_link("127.0.0.1", server.port());
  SteadyClock clock;
  std::array<std::byte, 512> bytes{};
  const auto run_until = [&](LinkState wanted) {
    for (const Instant end = clock.now() + 2s; clock.now() < end;) {
      server.accept();
      server.write(bytes);
      LinkState state{};
      without_heap([&] {
        state = link->state();
        link->read(bytes);
        link->write(bytes);
        (void)link->why();
      });
      server.read(bytes);
      if (state == wanted && (wanted != LinkState::open || server.connected())) return true;
      clock.sleep_until(clock.now() + 100us);
    }
    return false;
  };
  link->open();  // the first time it allocates
  allocations = 0;
  REQUIRE(run_until(LinkState::open));
  server.hang_up();
  REQUIRE(run_until(LinkState::lost));
  without_heap([&] { link->open(); });
  REQUIRE(run_until(LinkState::open));
  CHECK(allocations == 0);
}
