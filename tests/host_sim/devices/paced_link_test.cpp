// A link as fast as its wire, on a clock that the test moves and a link within that takes and gives at once.
#include "host_sim/devices/paced_link.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <vector>

using namespace moldloft;
using namespace moldloft::host_sim;
using namespace std::chrono_literals;

namespace {

struct Memory final : hal::ByteLink {
  std::size_t taken = 0, waiting = 0, most_at_once = SIZE_MAX;
  hal::LinkState is = hal::LinkState::closed;
  void open() override { is = hal::LinkState::open; }
  void close() noexcept override { is = hal::LinkState::closed; }
  std::size_t read(std::span<std::byte> out) noexcept override {
    CHECK_FALSE(out.empty());
    const std::size_t count = std::min(out.size(), waiting);
    waiting -= count;
    return count;
  }
  std::size_t write(std::span<const std::byte> in) noexcept override {
    const std::size_t count = std::min(in.size(), most_at_once);
    taken += count;
    return count;
  }
  hal::LinkState state() noexcept override { return is; }
  std::string_view why() const noexcept override { return "memory"; }
};

struct Bench {
  hal::VirtualClock clock;
  Memory* memory = new Memory;
  PacedLink link;
  std::vector<std::byte> bytes = std::vector<std::byte>(1'000'000);

  explicit Bench(double bytes_per_second)
      : link{std::unique_ptr<hal::ByteLink>{memory}, clock, bytes_per_second} {
    clock.sleep_until(1h);
  }
  void pass(hal::Duration d) { clock.sleep_until(clock.now() + d); }
};

}  // namespace

TEST_CASE("a frame goes out as fast as 100 Mb/s carry it") {
  Bench bench{12.5e6};
  std::size_t sent = 0;
  for (int ms = 0; ms < 24; ++ms) {
    sent += bench.link.write(std::span{bench.bytes}.subspan(sent));
    CHECK(sent == static_cast<std::size_t>(12'500 * (ms + 1)));
    CHECK(bench.link.write(std::span{bench.bytes}.subspan(sent)) == 0);  // in the same moment
    bench.pass(1ms);
  }
  CHECK(bench.memory->taken == sent);
}

TEST_CASE("a device that looks late finds that the wire went on meanwhile, for 50 ms at most") {
  Bench bench{12.5e6};
  CHECK(bench.link.write(bench.bytes) == 12'500);
  bench.pass(7ms);
  CHECK(bench.link.write(bench.bytes) == 7 * 12'500);
  bench.pass(3s);
  CHECK(bench.link.write(bench.bytes) == 50 * 12'500);
  bench.memory->waiting = 1'000'000;
  CHECK(bench.link.read(bench.bytes) == 12'500);
  bench.pass(7ms);
  CHECK(bench.link.read(bench.bytes) == 7 * 12'500);
}

TEST_CASE("an idle wire saves nothing up, in either direction") {
  Bench bench{11520};
  CHECK(bench.link.write(std::span{bench.bytes}.first(5)) == 5);
  bench.pass(1h);
  CHECK(bench.link.write(std::span{bench.bytes}.first(60)) == 11);
  CHECK(bench.link.read(bench.bytes) == 0);
  bench.pass(1h);
  bench.memory->waiting = 60;
  CHECK(bench.link.read(bench.bytes) == 11);
}

TEST_CASE("a line of 60 characters comes in over 115200 baud in five milliseconds") {
  Bench bench{11520};
  bench.memory->waiting = 60;
  std::size_t come = 0;
  int looks = 0;
  for (; come < 60; ++looks, bench.pass(1ms)) {
    while (const std::size_t count = bench.link.read(bench.bytes)) come += count;
    REQUIRE(looks < 20);
  }
  CHECK(looks == 6);  // the first finds what a millisecond brought
}

TEST_CASE("a link that takes no more keeps the wire's pace from running up") {
  Bench bench{12.5e6};
  bench.memory->most_at_once = 100;
  for (int i = 0; i < 1000; ++i, bench.pass(1ms)) CHECK(bench.link.write(bench.bytes) == 100);
  bench.memory->most_at_once = SIZE_MAX;
  CHECK(bench.link.write(bench.bytes) <= 50 * 12'500);
}

TEST_CASE("state and its reason are those of the link within") {
  Bench bench{11520};
  CHECK(bench.link.state() == hal::LinkState::closed);
  bench.link.open();
  CHECK(bench.link.state() == hal::LinkState::open);
  bench.link.close();
  CHECK(bench.link.state() == hal::LinkState::closed);
  CHECK(bench.link.why() == "memory");
}
