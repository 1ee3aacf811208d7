#include "hal/links/cable.hpp"

#include <doctest/doctest.h>

#include <numeric>
#include <random>
#include <string>
#include <vector>

using namespace moldloft::hal;

namespace {

std::vector<std::byte> counting(std::size_t count) {
  std::vector<std::byte> bytes(count);
  for (std::size_t i = 0; i < count; ++i) bytes[i] = static_cast<std::byte>(i * 7);
  return bytes;
}

std::size_t arrived(ByteLink& link) {
  std::array<std::byte, 4096> out;
  return link.read(out);
}

}  // namespace

TEST_CASE("bytes arrive one byte time after another, the delay on top") {
  VirtualClock clock;
  Cable cable{clock, {.bytes_per_second = 1000, .delay = 5ms}};
  cable.host().open();
  CHECK(cable.host().write(counting(10)) == 10);

  clock.sleep_until(5ms);
  CHECK(arrived(cable.device()) == 0);
  clock.sleep_until(6ms - 1ns);
  CHECK(arrived(cable.device()) == 0);
  clock.sleep_until(6ms);
  CHECK(arrived(cable.device()) == 1);
  clock.sleep_until(9ms);
  CHECK(arrived(cable.device()) == 3);
  clock.sleep_until(1s);
  CHECK(arrived(cable.device()) == 6);
  CHECK(arrived(cable.device()) == 0);
}

TEST_CASE("what is written while the line is busy queues up behind, after a pause the line starts afresh") {
  VirtualClock clock;
  Cable cable{clock, {.bytes_per_second = 1000}};
  cable.host().open();
  cable.host().write(counting(3));  // on the line until 3 ms
  clock.sleep_until(2ms);
  cable.host().write(counting(2));  // until 5 ms
  clock.sleep_until(4ms);
  CHECK(arrived(cable.device()) == 4);
  clock.sleep_until(10ms);
  cable.host().write(counting(1));
  CHECK(arrived(cable.device()) == 1);
  clock.sleep_until(11ms);
  CHECK(arrived(cable.device()) == 1);
}

TEST_CASE("a serial line of 115200 baud carries 11520 bytes in a second, however they are read") {
  VirtualClock clock;
  Cable cable{clock, {.bytes_per_second = 11520}};
  cable.host().open();
  cable.host().write(counting(20'000));
  std::size_t total = 0;
  for (Instant t = 1ms; t <= 1s; t += 1ms) {
    clock.sleep_until(t);
    total += arrived(cable.device());
  }
  CHECK(total == 11520);
}

TEST_CASE("a full cable takes no more until something has been read, and nothing is lost or turned around") {
  VirtualClock clock;
  Cable cable{clock, {.capacity_bytes = 100, .bytes_per_second = 1e9}};
  cable.host().open();
  std::mt19937 random{5};
  const auto sent = counting(10'000);
  std::vector<std::byte> received;
  std::size_t written = 0;
  while (received.size() < sent.size()) {
    written += cable.host().write(
        std::span{sent}.subspan(written, std::min<std::size_t>(random() % 90, sent.size() - written)));
    clock.sleep_until(clock.now() + 1us);
    std::array<std::byte, 64> out;
    const auto count = cable.device().read(std::span{out}.first(1 + random() % 63));
    received.insert(received.end(), out.begin(), out.begin() + count);
  }
  CHECK(received == sent);
  CHECK(cable.host().write(counting(101)) == 100);
  CHECK(cable.host().write(counting(1)) == 0);
}

TEST_CASE("a stalled reader does not break the cable, however many single writes pile up") {
  VirtualClock clock;
  Cable cable{clock, {.bytes_per_second = 1e6}};
  cable.host().open();
  std::size_t written = 0;
  for (int tick = 0; tick < 6000; ++tick) {
    written += cable.host().write(counting(1));
    clock.sleep_until(clock.now() + 1ms);
  }
  CHECK(written == 4096);  // as many separate writes as a cable remembers
  std::size_t read = 0;
  for (int i = 0; i < 10; ++i) read += arrived(cable.device());
  CHECK(read == 4096);
  CHECK(cable.host().write(counting(1)) == 1);
}

TEST_CASE("a cut loses what is on the way, on both sides, only a mended cable opens again") {
  VirtualClock clock;
  Cable cable{clock, {.bytes_per_second = 1000}};
  CHECK(cable.device().state() == LinkState::closed);
  cable.host().open();
  CHECK(cable.host().state() == LinkState::open);
  CHECK(cable.device().state() == LinkState::open);
  cable.host().write(counting(10));
  cable.cut();
  CHECK(cable.host().state() == LinkState::lost);
  CHECK(cable.host().why() == "the cable is cut");
  CHECK(cable.device().state() == LinkState::lost);
  CHECK(cable.host().write(counting(1)) == 0);
  cable.host().open();
  CHECK(cable.host().state() == LinkState::lost);
  cable.mend();
  CHECK(cable.host().state() == LinkState::lost);  // a lost link stays lost until it is opened
  cable.host().open();
  CHECK(cable.host().state() == LinkState::open);
  CHECK(cable.device().state() == LinkState::open);
  clock.sleep_until(1s);
  CHECK(arrived(cable.device()) == 0);
}

TEST_CASE("a host that opens again at once is a new connection, and the device sees the old one end") {
  VirtualClock clock;
  Cable cable{clock, {}};
  cable.host().open();
  CHECK(cable.device().state() == LinkState::open);
  cable.host().open();
  CHECK(cable.device().state() == LinkState::lost);
  CHECK(cable.device().state() == LinkState::open);
}

TEST_CASE("either end can hang up on the other") {
  VirtualClock clock;
  Cable cable{clock, {}};
  cable.host().open();
  cable.device().close();
  CHECK(cable.host().state() == LinkState::lost);
  CHECK(cable.host().why() == "closed by the far end");
  cable.host().open();
  CHECK(cable.device().state() == LinkState::open);
  cable.host().close();
  CHECK(cable.host().state() == LinkState::closed);
  CHECK(cable.device().state() == LinkState::lost);
}
