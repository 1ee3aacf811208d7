// What ByteLink promises, asked of every back-end that can be opened here. The serial port on a
// pseudo-terminal is asked the same in tests/host_sim, where the preload library is.
#include "hal/links/byte_link.hpp"

#include "hal/links/cable.hpp"
#include "hal/links/tcp_link.hpp"
#include "hal/loopback_server.hpp"
#include "hal/record/recorder.hpp"
#include "hal/record/tapped_link.hpp"

#include <doctest/doctest.h>

#include <array>
#include <functional>
#include <random>
#include <vector>

using namespace moldloft::hal;

namespace {

// A link with a far end, and time that passes for both.
class Bench {
 public:
  virtual ~Bench() = default;
  virtual ByteLink& link() = 0;
  virtual std::size_t far_read(std::span<std::byte>) = 0;
  virtual std::size_t far_write(std::span<const std::byte>) = 0;
  virtual bool far_connected() = 0;
  virtual void far_hang_up() = 0;
  virtual void pass() = 0;  // a moment

  bool wait_for(const std::function<bool()>& condition) {
    for (int i = 0; i < 2000; ++i) {
      if (condition()) return true;
      pass();
    }
    return false;
  }
  bool open() {
    link().open();
    return wait_for([&] { return link().state() == LinkState::open && far_connected(); });
  }
};

class CableBench : public Bench {
 public:
  ByteLink& link() override { return cable_.host(); }
  std::size_t far_read(std::span<std::byte> out) override { return cable_.device().read(out); }
  std::size_t far_write(std::span<const std::byte> in) override { return cable_.device().write(in); }
  bool far_connected() override { return cable_.device().state() == LinkState::open; }
  void far_hang_up() override { cable_.device().close(); }
  void pass() override { clock_.sleep_until(clock_.now() + 1ms); }

 protected:
  VirtualClock clock_;
  Cable cable_{clock_, {.capacity_bytes = 100'000, .delay = 2ms}};
};

class TappedBench final : public CableBench {
 public:
  ByteLink& link() override { return tapped_; }

 private:
  Recorder recorder_{{}};
  TappedLink tapped_{cable_.host(), LinkId::robot, recorder_, clock_};
};

class TcpBench final : public Bench {
 public:
  ByteLink& link() override { return *link_; }
  std::size_t far_read(std::span<std::byte> out) override { return server_.read(out); }
  std::size_t far_write(std::span<const std::byte> in) override { return server_.write(in); }
  bool far_connected() override { return server_.connected(); }
  void far_hang_up() override { server_.hang_up(); }
  void pass() override {
    server_.accept();
    clock_.sleep_until(clock_.now() + 100us);
  }

 private:
  SteadyClock clock_;
  LoopbackServer server_;
  std::unique_ptr<ByteLink> link_ = make_tcp_link("127.0.0.1", server_.port());
};

std::vector<std::byte> random_bytes(std::uint32_t seed, std::size_t count) {
  std::mt19937 random{seed};
  std::vector<std::byte> bytes(count);
  for (auto& byte : bytes) byte = static_cast<std::byte>(random());
  return bytes;
}

}  // namespace

TEST_CASE_TEMPLATE("before open() nothing moves, close() may be called at any time", B, CableBench,
                   TappedBench, TcpBench) {
  B bench;
  std::array<std::byte, 16> bytes{};
  CHECK(bench.link().state() == LinkState::closed);
  CHECK(bench.link().read(bytes) == 0);
  CHECK(bench.link().write(bytes) == 0);
  bench.link().close();
  bench.link().close();
  CHECK(bench.link().state() == LinkState::closed);
}

TEST_CASE_TEMPLATE("what goes in comes out at the far end, in order, both ways, in pieces of any size", B,
                   CableBench, TappedBench, TcpBench) {
  B bench;
  REQUIRE(bench.open());
  CHECK(bench.link().why().empty());
  const auto out = random_bytes(1, 500'000);
  const auto back = random_bytes(2, 500'000);
  std::vector<std::byte> at_far, at_near;
  std::size_t sent = 0, returned = 0;
  std::mt19937 random{3};
  std::array<std::byte, 5000> buffer;
  const auto piece = [&](const auto& all, std::size_t from) {
    return std::span{all}.subspan(from, std::min<std::size_t>(random() % 5000, all.size() - from));
  };
  REQUIRE(bench.wait_for([&] {
    sent += bench.link().write(piece(out, sent));
    returned += bench.far_write(piece(back, returned));
    std::size_t count = bench.far_read(std::span{buffer}.first(1 + random() % 4999));
    at_far.insert(at_far.end(), buffer.begin(), buffer.begin() + count);
    count = bench.link().read(std::span{buffer}.first(1 + random() % 4999));
    at_near.insert(at_near.end(), buffer.begin(), buffer.begin() + count);
    return at_far.size() == out.size() && at_near.size() == back.size();
  }));
  CHECK(at_far == out);
  CHECK(at_near == back);
  CHECK(bench.link().state() == LinkState::open);
}

TEST_CASE_TEMPLATE("a far end that does not read stops the writer, without a wait and without a loss", B,
                   CableBench, TappedBench, TcpBench) {
  B bench;
  REQUIRE(bench.open());
  const auto block = random_bytes(4, 65536);
  std::size_t taken = 0;
  for (int i = 0; i < 1000; ++i) taken += bench.link().write(block);
  CHECK(taken < 1000 * block.size());
  CHECK(bench.link().write(block) == 0);
  CHECK(bench.link().state() == LinkState::open);
  std::array<std::byte, 65536> buffer;
  std::size_t arrived = 0;
  REQUIRE(bench.wait_for([&] {
    arrived += bench.far_read(buffer);
    return arrived == taken;
  }));
}

TEST_CASE_TEMPLATE("a far end that hangs up is noticed, and says so, opened again the link is as new", B,
                   CableBench, TappedBench, TcpBench) {
  B bench;
  REQUIRE(bench.open());
  std::array<std::byte, 16> bytes{};
  bench.far_hang_up();
  REQUIRE(bench.wait_for([&] { return bench.link().state() == LinkState::lost; }));
  CHECK_FALSE(bench.link().why().empty());
  CHECK(bench.link().read(bytes) == 0);
  CHECK(bench.link().write(bytes) == 0);
  for (int i = 0; i < 10; ++i) bench.pass();
  CHECK(bench.link().state() == LinkState::lost);
  REQUIRE(bench.open());
  REQUIRE(bench.wait_for([&] { return bench.far_write(bytes) == bytes.size(); }));
  std::size_t arrived = 0;
  REQUIRE(bench.wait_for([&] {
    arrived += bench.link().read(bytes);
    return arrived == bytes.size();
  }));
}

TEST_CASE_TEMPLATE("reading or writing nothing is nothing", B, CableBench, TappedBench, TcpBench) {
  B bench;
  REQUIRE(bench.open());
  CHECK(bench.link().read({}) == 0);
  CHECK(bench.link().write({}) == 0);
  CHECK(bench.link().state() == LinkState::open);
}
