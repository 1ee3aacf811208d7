// Opens a serial device with the controller's own driver, sends PNG, prints the answer. Exit code 0 when one
// came.
#include <cstdio>
#include <string>

#include "hal/clock.hpp"
#include "hal/robot_line.hpp"
#include "hal/serial_link.hpp"

using namespace moldloft::hal;
using namespace std::chrono_literals;

int main(int argc, char** argv) {
  if (argc != 2) return 2;
  const auto link = make_serial_link(argv[1], 115200);
  link->open();
  if (link->state() != LinkState::open) {
    std::fprintf(stderr, "%s\n", std::string(link->why()).c_str());
    return 3;
  }
  robot_line::Command ping;
  ping.verb = robot_line::Verb::png;
  const auto line = robot_line::format(ping);
  if (link->write(std::as_bytes(std::span{line.view()})) != line.view().size()) return 4;
  SteadyClock clock;
  std::string answer;
  for (int wait = 0; wait < 2000 && !answer.ends_with('\n'); ++wait) {
    std::byte bytes[64];
    const auto count = link->read(bytes);
    answer.append(reinterpret_cast<const char*>(bytes), count);
    if (count == 0) clock.sleep_until(clock.now() + 1ms);
  }
  link->close();
  std::printf("%s", answer.c_str());
  return answer == "<0000 PNG *" + std::to_string(robot_line::fletcher16("0000 PNG")) + "\n" ? 0 : 5;
}
