// A driver's session on a link that does what the test says, at times that the test says.
#include "hal/links/device_session.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <string>
#include <vector>

using namespace moldloft::hal;
using State = DeviceSession::State;
using News = DeviceSession::News;

namespace {

struct ScriptedLink final : ByteLink {
  LinkState now = LinkState::closed;
  int opened = 0, closed = 0, looks = 0;
  std::size_t takes = 1000;  // bytes of the next write()
  std::string sent, arrived;

  void open() noexcept override { ++opened, now = LinkState::opening; }
  void close() noexcept override { ++closed, now = LinkState::closed; }
  std::size_t read(std::span<std::byte> out) noexcept override {
    const std::size_t count = std::min(out.size(), arrived.size());
    std::ranges::copy(std::as_bytes(std::span{arrived}.first(count)), out.begin());
    arrived.erase(0, count);
    return count;
  }
  std::size_t write(std::span<const std::byte> in) noexcept override {
    const std::size_t count = std::min(in.size(), takes);
    sent.append(reinterpret_cast<const char*>(in.data()), count);
    return count;
  }
  LinkState state() noexcept override { return ++looks, now; }
  std::string_view why() const noexcept override { return "the script says so"; }
};

struct Bench {
  explicit Bench(const DeviceSession::Settings& settings = {}) : session{link, settings} {}
  ScriptedLink link;
  DeviceSession session;

  bool write(std::string_view text) { return session.write(std::as_bytes(std::span{text})); }
  void open(Instant now) {
    session.start(now);
    link.now = LinkState::open;
    REQUIRE(session.receive() == News::opened);
  }
  // Loses the connection and says how long it takes, in steps of 1 ms, until the link is opened again.
  Duration pause_after_loss(Instant& now) {
    session.lose(now);
    const Instant lost = now;
    for (const int before = link.opened; link.opened == before && now - lost < 10s; now += 1ms) {
      CHECK(session.transmit(now) == News::none);
      if (link.opened > before) break;
    }
    return now - lost;
  }
};

}  // namespace

TEST_CASE("a session opens its link at start, once, and tells the one time that it is open") {
  Bench bench;
  CHECK(bench.session.state() == State::closed);
  CHECK(bench.session.receive() == News::none);
  CHECK(bench.link.looks == 0);  // nothing to look at yet
  bench.session.start(5ms);
  bench.session.start(6ms);
  CHECK(bench.link.opened == 1);
  CHECK(bench.session.state() == State::opening);
  CHECK(bench.session.receive() == News::none);
  bench.link.now = LinkState::open;
  CHECK(bench.session.receive() == News::opened);
  CHECK(bench.session.is_open());
  CHECK(bench.session.receive() == News::none);
  CHECK(bench.link.looks == 3);  // two looks may get two answers: one a call
}

TEST_CASE("a connection that does not come is news when its time is over, and not before") {
  Bench bench{{.connect_timeout = 700ms}};
  bench.session.start(100ms);
  CHECK(bench.session.transmit(799ms) == News::none);
  CHECK(bench.session.transmit(800ms) == News::no_connection);
  CHECK(bench.session.transmit(801ms) == News::no_connection);  // the driver has not said lose() yet
  bench.session.lose(801ms);
  CHECK(bench.session.state() == State::waiting);
  CHECK(bench.link.closed == 1);
}

TEST_CASE("an open connection has no time limit") {
  Bench bench{{.connect_timeout = 700ms}};
  bench.open(0ms);
  CHECK(bench.session.transmit(1h) == News::none);
  CHECK(bench.session.is_open());
}

TEST_CASE(
    "a link that is lost is news until the driver lets go of it, while it opens as well as when it is open") {
  Bench bench;
  bench.session.start(0ms);
  bench.link.now = LinkState::lost;
  CHECK(bench.session.receive() == News::lost);
  CHECK(bench.session.why() == "the script says so");
  bench.session.lose(0ms);
  CHECK(bench.session.receive() == News::none);
  CHECK(bench.session.transmit(100ms) == News::none);
  bench.link.now = LinkState::open;
  CHECK(bench.session.receive() == News::opened);
  bench.link.now = LinkState::lost;
  CHECK(bench.session.receive() == News::lost);
  CHECK(bench.session.receive() == News::lost);
  bench.session.lose(200ms);
  CHECK(bench.link.closed == 2);
  CHECK(bench.session.receive() == News::none);
}

TEST_CASE("the pause before the next attempt doubles up to its limit, and a greeting makes it short again") {
  Bench bench{{.first_back_off = 30ms, .last_back_off = 200ms}};
  Instant now = 1s;
  bench.session.start(now);
  for (const Duration pause : {30ms, 60ms, 120ms, 200ms, 200ms}) CHECK(bench.pause_after_loss(now) == pause);
  bench.link.now = LinkState::open;
  REQUIRE(bench.session.receive() == News::opened);
  CHECK(bench.pause_after_loss(now) == 200ms);  // a link that opens is not yet the device that we want
  bench.link.now = LinkState::open;
  REQUIRE(bench.session.receive() == News::opened);
  bench.session.greeted();
  for (const Duration pause : {30ms, 60ms}) CHECK(bench.pause_after_loss(now) == pause);
}

TEST_CASE("what the link does not take at once stays in order, and goes with the next flush") {
  Bench bench;
  bench.open(0ms);
  CHECK(bench.write("abcdef"));
  bench.link.takes = 4;
  bench.session.flush();
  CHECK(bench.link.sent == "abcd");
  CHECK(bench.write("gh"));
  bench.session.flush();
  CHECK(bench.link.sent == "abcdefgh");
  bench.session.flush();
  CHECK(bench.link.sent == "abcdefgh");  // nothing twice
}

TEST_CASE("a message goes into the outbox whole or not at all, to its last byte") {
  Bench bench{{.outbox_bytes = 8}};
  bench.open(0ms);
  CHECK(bench.write("12345"));
  CHECK_FALSE(bench.write("6789"));
  CHECK(bench.session.room().size() == 3);
  CHECK(bench.write("678"));
  CHECK(bench.session.room().empty());
  CHECK_FALSE(bench.write("9"));
  bench.session.flush();
  CHECK(bench.link.sent == "12345678");
  CHECK(bench.session.room().size() == 8);
}

TEST_CASE("a message that is encoded in its place is one like any other") {
  Bench bench{{.outbox_bytes = 8}};
  bench.open(0ms);
  CHECK(bench.write("ab"));
  std::ranges::fill(bench.session.room().first(3), std::byte{'x'});
  bench.session.add(3);
  bench.session.add(0);  // an encoder without room writes nothing
  bench.session.flush();
  CHECK(bench.link.sent == "abxxx");
}

TEST_CASE("nothing is written before the connection is open, and nothing of one into the next") {
  Bench bench;
  bench.session.start(0ms);
  CHECK(bench.write("early"));
  bench.session.flush();
  CHECK(bench.link.sent.empty());
  bench.link.now = LinkState::open;
  REQUIRE(bench.session.receive() == News::opened);
  bench.link.takes = 2;
  bench.session.flush();
  CHECK(bench.link.sent == "ea");
  bench.session.lose(1s);
  bench.session.flush();
  CHECK(bench.link.sent == "ea");
  bench.session.transmit(2s);
  bench.link.now = LinkState::open;
  REQUIRE(bench.session.receive() == News::opened);
  bench.link.takes = 1000;
  bench.session.flush();
  CHECK(bench.link.sent == "ea");
  CHECK(bench.write("new"));
  bench.session.flush();
  CHECK(bench.link.sent == "eanew");
}

TEST_CASE("bytes are counted over all connections, and read from an open one only") {
  Bench bench;
  std::vector<std::byte> in(4);
  bench.link.arrived = "123456";
  bench.session.start(0ms);
  CHECK(bench.session.read(in) == 0);
  bench.link.now = LinkState::open;
  REQUIRE(bench.session.receive() == News::opened);
  CHECK(bench.session.read(in) == 4);
  CHECK(in.back() == std::byte{'4'});
  bench.session.lose(1s);
  CHECK(bench.session.read(in) == 0);
  bench.session.transmit(2s);
  bench.link.now = LinkState::open;
  REQUIRE(bench.session.receive() == News::opened);
  CHECK(bench.session.read(in) == 2);
  CHECK(bench.session.received() == 6);
}

TEST_CASE(
    "a heartbeat is due a period after what was last said, silence too long a limit after what was heard") {
  Bench bench{{.heartbeat = 1s, .silent_limit = 3s}};
  bench.open(10s);
  CHECK_FALSE(bench.session.heartbeat_due(10'999ms));
  CHECK(bench.session.heartbeat_due(11s));
  bench.session.said(11s);
  CHECK_FALSE(bench.session.heartbeat_due(11'999ms));
  CHECK(bench.session.heartbeat_due(12s));

  CHECK_FALSE(bench.session.is_silent(13s));
  CHECK(bench.session.is_silent(13'001ms));
  bench.session.heard(12s);
  CHECK(bench.session.silence(13s) == 1s);
  CHECK_FALSE(bench.session.is_silent(15s));
  CHECK(bench.session.is_silent(15'001ms));

  bench.session.lose(20s);  // the next connection begins its own count
  bench.session.transmit(30s);
  CHECK_FALSE(bench.session.heartbeat_due(30'999ms));
  CHECK_FALSE(bench.session.is_silent(33s));
}
