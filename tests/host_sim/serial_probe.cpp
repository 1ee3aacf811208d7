// Opens a serial device with the controller's own driver, sends PNG until an answer comes, prints it. Exit
// code 0 when it is the right one. A server empties the line when it learns of a new host, so the first PNG
// may go under.
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
  SteadyClock clock;
  std::string answer;
  for (int wait = 0; wait < 10000 && !answer.ends_with('\n'); ++wait) {
    if (wait % 200 == 0 && link->write(std::as_bytes(std::span{line.view()})) != line.view().size()) return 4;
    std::byte bytes[64];
    const auto count = link->read(bytes);
    answer.append(reinterpret_cast<const char*>(bytes), count);
    if (count == 0) clock.sleep_until(clock.now() + 1ms);
  }
  link->close();
  std::printf("%s", answer.c_str());
  return answer.starts_with("<0000 PNG *" + std::to_string(robot_line::fletcher16("0000 PNG")) + "\n") ? 0
                                                                                                       : 5;
}
