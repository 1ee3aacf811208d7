// Opens a serial device with the controller's own driver, sends PNG until an answer comes, prints it. Exit
// code 0 when it is the right one. A server empties the line when it learns of a new host, so the first PNG
// may go under.
//
// With a second argument it says one byte and listens until the far end is gone: exit code 0 when a
// silent line was open and the line without a far end is lost.
#include "hal/base/clock.hpp"
#include "hal/links/serial_link.hpp"
#include "hal/robot/robot_line.hpp"

#include <cstdio>
#include <string>

using namespace moldloft::hal;
using namespace std::chrono_literals;

namespace {

int wait_for_hang_up(ByteLink& link) {
  SteadyClock clock;
  const std::byte here{'!'};
  std::byte bytes[64];
  for (int silent = 0; clock.now() < 10s; ++silent) {
    if (silent == 0) link.write({&here, 1});  // and no more: a write would notice by itself
    if (link.read(bytes) != 0) return 6;
    if (link.state() == LinkState::lost) {
      std::printf("%s\n", std::string(link.why()).c_str());
      return silent > 50 ? 0 : 7;  // silence alone is no loss
    }
    clock.sleep_until(clock.now() + 1ms);
  }
  return 8;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2 && argc != 3) return 2;
  const auto link = make_serial_link(argv[1], 115200);
  link->open();
  if (link->state() != LinkState::open) {
    std::fprintf(stderr, "%s\n", std::string(link->why()).c_str());
    return 3;
  }
  if (argc == 3) return wait_for_hang_up(*link);
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
