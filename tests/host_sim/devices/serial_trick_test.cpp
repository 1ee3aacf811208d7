#include "hal/base/clock.hpp"
#include "hal/links/tcp_link.hpp"
#include "hal/scanner/psc1.hpp"
#include "host_sim/cell/cell_description.hpp"
#include "host_sim/devices/pty_link.hpp"
#include "host_sim/devices/tcp_server_link.hpp"

#include <doctest/doctest.h>

#include <array>
#include <atomic>
#include <fcntl.h>
#include <filesystem>
#include <string>
#include <sys/wait.h>
#include <thread>
#include <unistd.h>

using namespace moldloft;
using namespace moldloft::host_sim;
using namespace std::chrono_literals;

namespace {

std::string name_of_this_test() { return "/tmp/moldloft_test_robot_" + std::to_string(::getpid()); }

// Serves PNG on the terminal from a thread of its own until told to end.
class Robot {
 public:
  explicit Robot(PtyLink& link)
      : server_(link, ArmDrive(make_scara({}), {}, 1), {}), thread_([this] { serve(); }) {}
  ~Robot() {
    end_ = true;
    thread_.join();
  }

 private:
  void serve() {
    hal::SteadyClock clock;
    while (!end_) {
      server_.step(clock.now());
      clock.sleep_until(clock.now() + 1ms);
    }
  }
  RobotServer server_;
  std::atomic<bool> end_ = false;
  std::thread thread_;
};

pid_t start_probe(const std::string& device, bool with_shim, const char* until_hang_up = nullptr) {
  const pid_t child = ::fork();
  if (child == 0) {
    if (with_shim) ::setenv("LD_PRELOAD", PTY_MODEM, 1);
    const int null = ::open("/dev/null", O_WRONLY);
    ::dup2(null, 1);
    ::dup2(null, 2);
    ::execl(SERIAL_PROBE, SERIAL_PROBE, device.c_str(), until_hang_up, nullptr);
    ::_exit(127);
  }
  return child;
}

int exit_code_of(pid_t child) {
  int status = 0;
  ::waitpid(child, &status, 0);
  return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

int probe(const std::string& device, bool with_shim) { return exit_code_of(start_probe(device, with_shim)); }

}  // namespace

TEST_CASE("the controller's own serial driver opens the robot's pseudo-terminal, again and again") {
  const auto link = PtyLink::create(name_of_this_test());
  REQUIRE_MESSAGE(link.has_value(), link.error().what);
  Robot robot(**link);
  CHECK(probe(name_of_this_test(), true) == 0);
  hal::SteadyClock clock;
  clock.sleep_until(clock.now() + 20ms);
  CHECK(probe(name_of_this_test(), true) == 0);  // after the first has hung up
}

TEST_CASE("a serial line that is silent is open, one whose far end has gone is lost") {
  auto link = PtyLink::create(name_of_this_test());
  REQUIRE_MESSAGE(link.has_value(), link.error().what);
  (*link)->open();
  const pid_t listener = start_probe(name_of_this_test(), true, "until the far end is gone");
  hal::SteadyClock clock;
  std::byte bytes[8];
  std::size_t heard = 0;
  while (heard == 0 && clock.now() < 5s) {
    if ((*link)->state() == hal::LinkState::open) heard = (*link)->read(bytes);
    clock.sleep_until(clock.now() + 1ms);
  }
  CHECK(heard == 1);
  clock.sleep_until(clock.now() + 200ms);
  link->reset();
  CHECK(exit_code_of(listener) == 0);
}

TEST_CASE("without the shim libserialport refuses it: the shim is what makes it work") {
  const auto link = PtyLink::create(name_of_this_test());
  REQUIRE(link.has_value());
  Robot robot(**link);
  CHECK(probe(name_of_this_test(), false) == 3);
}

TEST_CASE("the terminal is open while a program has it open") {
  const auto link = PtyLink::create(name_of_this_test());
  REQUIRE(link.has_value());
  auto& device = **link;
  device.open();
  CHECK(device.state() == hal::LinkState::opening);
  const int host = ::open(name_of_this_test().c_str(), O_RDWR | O_NOCTTY);
  REQUIRE(host >= 0);
  CHECK(device.state() == hal::LinkState::open);
  const std::array<std::byte, 2> sent = {std::byte{13}, std::byte{10}};
  CHECK(device.write(sent) == 2);
  std::array<std::byte, 8> got{};
  CHECK(::read(host, got.data(), got.size()) == 2);  // both as they were: the line edits nothing
  CHECK(got[0] == std::byte{13});
  ::close(host);
  CHECK(device.state() == hal::LinkState::lost);
  device.open();
  CHECK(device.state() == hal::LinkState::opening);
}

TEST_CASE("the terminal's name is taken away with it, and a file in its place is left alone") {
  const std::string name = name_of_this_test();
  {
    const auto link = PtyLink::create(name);
    REQUIRE(link.has_value());
    CHECK(std::filesystem::is_symlink(name));
  }
  CHECK_FALSE(std::filesystem::exists(std::filesystem::symlink_status(name)));
  ::close(::open(name.c_str(), O_CREAT | O_WRONLY, 0600));
  CHECK_FALSE(PtyLink::create(name).has_value());
  CHECK(std::filesystem::is_regular_file(name));
  std::filesystem::remove(name);
}

TEST_CASE("a client on the scanner's port comes, goes and comes again") {
  const auto server = TcpServerLink::listen_on(0);
  REQUIRE(server.has_value());
  auto& device = **server;
  CHECK(TcpServerLink::listen_on(device.port()).error().what.find("in use") != std::string::npos);
  device.open();
  CHECK(device.state() == hal::LinkState::opening);
  const auto until = [](auto&& condition) {
    hal::SteadyClock clock;
    for (int k = 0; k < 2000; ++k) {
      if (condition()) return true;
      clock.sleep_until(clock.now() + 1ms);
    }
    return false;
  };
  for (int round = 0; round < 2; ++round) {
    const auto client = hal::make_tcp_link("127.0.0.1", device.port());
    client->open();
    REQUIRE(until(
        [&] { return client->state() == hal::LinkState::open && device.state() == hal::LinkState::open; }));
    const std::array<std::byte, 3> sent = {std::byte{1}, std::byte{2}, std::byte{3}};
    CHECK(client->write(sent) == 3);
    std::array<std::byte, 8> got{};
    CHECK(until([&] { return device.read(got) == 3; }));
    client->close();
    CHECK(until([&] { return device.state() == hal::LinkState::lost; }));
    device.open();
  }
  const auto first = hal::make_tcp_link("127.0.0.1", device.port());
  first->open();
  REQUIRE(until([&] { return device.state() == hal::LinkState::open; }));
  const auto second = hal::make_tcp_link("127.0.0.1", device.port());
  second->open();  // replaces the first
  CHECK(until([&] { return device.state() == hal::LinkState::lost; }));
  CHECK(until([&] { return first->state() == hal::LinkState::lost; }));
  device.open();
  CHECK(device.state() == hal::LinkState::open);
  CHECK(second->state() == hal::LinkState::open);
}
