#include "host_sim/runs/device_host.hpp"

#include "firmware_like/process/console.hpp"
#include "firmware_like/process/whole_file.hpp"
#include "hal/base/printable_text.hpp"
#include "hal/links/cable.hpp"
#include "hal/links/serial_link.hpp"
#include "host_sim/cell/cell_config.hpp"
#include "host_sim/cell/world.hpp"
#include "host_sim/cell/world_clock.hpp"
#include "host_sim/devices/paced_link.hpp"
#include "host_sim/devices/pty_link.hpp"
#include "host_sim/devices/tcp_server_link.hpp"

#include <fmt/format.h>

#include <csignal>

namespace moldloft::host_sim {

using firmware_like::flush_shown;
using firmware_like::say;
using firmware_like::show;

namespace {

constexpr hal::Duration step_time = std::chrono::milliseconds{1};

volatile std::sig_atomic_t asked_to_end = 0;
void ask_to_end(int) { asked_to_end = 1; }

int failed(const SimError& error) {
  say(fmt::format("moldloft-sim devices: {}\n", hal::printable(error.what)));
  return 1;
}

void catch_signals() {
  struct sigaction action {};
  action.sa_handler = ask_to_end;
  ::sigaction(SIGINT, &action, nullptr);
  ::sigaction(SIGTERM, &action, nullptr);
  ::sigaction(SIGHUP, &action, nullptr);
}

// The robot's end of the line, and the device by which the controller reaches the other end.
struct RobotLine {
  std::unique_ptr<hal::ByteLink> link;
  std::string served_on;
  CellAddresses controllers;  // what the controller is to be told of it
};

std::expected<RobotLine, SimError> robot_line(const DeviceOptions& options) {
  if (options.robot_port) {
    auto port = TcpServerLink::listen_on(*options.robot_port, "--robot-port");
    if (!port) return std::unexpected(port.error());
    const std::uint16_t number = (*port)->port();
    return RobotLine{std::move(*port), fmt::format("127.0.0.1:{}", number), {.robot_port = number}};
  }
  if (options.robot_serial.empty()) {
    auto pty = PtyLink::create(options.robot_pty);
    if (!pty) return std::unexpected(pty.error());
    const std::string path = (*pty)->path();
    return RobotLine{std::move(*pty), path, {.robot_device = path}};
  }
  // The line's format is the controller's own default: the servers know one robot.
  auto port = hal::make_serial_link(options.robot_serial, firmware_like::RobotConfig{}.place.baud);
  port->open();
  if (port->state() != hal::LinkState::open) return std::unexpected(SimError{std::string(port->why())});
  return RobotLine{std::move(port), options.robot_serial, {.robot_device = options.controller_serial}};
}

// What the arm and the laser were made to do, as it happens: whoever tests a controller sees what moved, and when.
class DeviceLog {
 public:
  void look(SimulatedWorld& world, hal::Instant now, hal::Instant since_start) {
    const auto motions = world.robot().counters().motions;
    const auto exposures = world.scanner().counters().exposures;
    if (motions != motions_) line("motion", motions_ = motions, since_start);
    if (const bool moves = world.robot().drive().moving(now); moves != moves_) {
      moves_ = moves;
      line(moves ? "moves" : "stands", motions, since_start);
    }
    if (exposures != exposures_) line("exposure", exposures_ = exposures, since_start);
  }

 private:
  static void line(const char* what, std::uint64_t number, hal::Instant at) {
    show(fmt::format("{} {} at {:.3f} s\n", what, number, std::chrono::duration<double>(at).count()));
    flush_shown();
  }
  std::uint64_t motions_ = 0, exposures_ = 0;
  bool moves_ = false;
};

}  // namespace

int run_devices(const DeviceOptions& options) {
  for (const Fault& fault : options.cell.faults) {
    if (fault.of_surface)
      return failed(
          {fmt::format("--fault {}: devices do not know which shots are of the surface: give a "
                       "number of a shot",
                       text_of(fault))});
  }
  const auto plate = placed_plate(options.cell);
  if (!plate) return failed(plate.error());
  if (const auto& remarks = plate->plate->remarks(); !remarks.empty())
    say(fmt::format("plate {}: {}\n", plate->plate->name(), remarks));
  auto scanner = TcpServerLink::listen_on(options.scanner_port, "--scanner-port");
  if (!scanner) return failed(scanner.error());
  const std::uint16_t scanner_port = (*scanner)->port();
  auto robot = robot_line(options);
  if (!robot) return failed(robot.error());

  if (!options.cell_toml.empty()) {
    CellAddresses here = robot->controllers;
    here.scanner_port = scanner_port;
    const bool ours = options.force || is_generated_cell(options.cell_toml);
    const auto written =
        firmware_like::write_file(options.cell_toml, cell_toml(options.cell, *plate, here),
                                  ours ? firmware_like::Existing::replaced : firmware_like::Existing::kept);
    if (!written) return failed({written.error().what});
  }

  catch_signals();
  hal::SteadyClock clock;
  PacedLink scanner_wire{std::move(*scanner), clock, hal::Cable::Settings{}.bytes_per_second};
  PacedLink robot_wire{std::move(robot->link), clock, serial_bytes_per_second};
  SimulatedWorld world(options.cell, *plate, scanner_wire, robot_wire);
  show(fmt::format("ready: scanner 127.0.0.1:{} robot {} plate {} seed {}\n", scanner_port, robot->served_on,
                   plate->plate->name(), options.cell.seed));
  flush_shown();

  const hal::Instant began = clock.now();
  hal::Instant next = began;
  DeviceLog log;
  while (asked_to_end == 0) {
    const hal::Instant now = clock.now();
    world.step(now);
    if (options.log) log.look(world, now, now - began);
    next = std::max(next + step_time, now);  // casting a frame takes several steps: they are not caught up
    clock.sleep_until(next);
  }
  const auto times = world.times();
  show(fmt::format(
      "ended: {} motions, {} exposures, {:.1f} s from first command to last done, idle {:.1f} %\n",
      world.robot().counters().motions, world.scanner().counters().exposures,
      std::chrono::duration<double>(times.total).count(), 100 * times.idle_fraction()));
  return 0;
}

}  // namespace moldloft::host_sim
