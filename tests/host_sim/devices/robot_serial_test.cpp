// The simulated robot on a serial port: the device server opens it as any program would. The port is a
// pseudo-terminal whose other end this test holds, so the modem-control requests are answered by the preloaded library.
#include "host_sim/child_process.hpp"
#include "host_sim/devices/pty_link.hpp"

#include <doctest/doctest.h>

#include <array>

using namespace moldloft;
using namespace moldloft::host_sim;
using namespace std::chrono_literals;

namespace {

// What comes over the line until it holds an LF, or what has come within the limit.
std::string line_from(PtyLink& cable, hal::Duration limit) {
  hal::SteadyClock clock;
  std::string text;
  while (clock.now() < limit && text.find('\n') == std::string::npos) {
    std::array<char, 128> bytes{};
    text.append(bytes.data(), cable.read(std::as_writable_bytes(std::span{bytes})));
    clock.sleep_until(clock.now() + 1ms);
  }
  return text;
}

}  // namespace

TEST_CASE("the simulated robot answers on a serial port, and the configuration names the controller's end") {
  const hal::TemporaryFolder folder;
  auto cable = PtyLink::create(folder.file("port"));
  REQUIRE(cable.has_value());
  ChildProcess devices{{MOLDLOFT_SIM, "devices", "--scanner-port", "0", "--robot-serial", folder.file("port"),
                        "--controller-serial", "/dev/ttyS1", "--cell", folder.file("cell.toml")},
                       PTY_MODEM};
  REQUIRE_MESSAGE(devices.prints("ready:", 20s), devices.err());
  CHECK(devices.out().find("robot " + folder.file("port") + " ") != std::string::npos);
  CHECK(text_of(folder.file("cell.toml")).find("\ndevice = \"/dev/ttyS1\"\n") != std::string::npos);

  (*cable)->open();
  REQUIRE((*cable)->state() == hal::LinkState::open);
  constexpr std::string_view synchronize = ">0000 SYN 48213 *23294\n";  // PROTOCOLS.md
  REQUIRE((*cable)->write(std::as_bytes(std::span{synchronize})) == synchronize.size());
  CHECK(line_from(**cable, 20s).starts_with("<0000 SYN 48213 "));
}

TEST_CASE("a serial port for the simulated robot that is none is refused in one line") {
  const auto refused =
      run_program({MOLDLOFT_SIM, "devices", "--scanner-port", "0", "--robot-serial", "/dev/ttyNONE"});
  CHECK(refused.exit_code == 1);
  CHECK(refused.err ==
        "moldloft-sim devices: /dev/ttyNONE does not exist: is the robot's cable plugged in, is the name "
        "right?\n");
  CHECK(refused.out == "");
  const auto both =
      run_program({MOLDLOFT_SIM, "devices", "--robot-serial", "/dev/ttyNONE", "--robot-pty", "/tmp/robot"});
  CHECK(both.exit_code == 1);
  CHECK(both.err.find("excludes") != std::string::npos);
}
