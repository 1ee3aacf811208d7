#include "host_sim/device_host.hpp"

#include <fmt/format.h>

#include <csignal>
#include <cstdio>

#include "firmware_like/results.hpp"
#include "host_sim/cell_config.hpp"
#include "host_sim/pty_link.hpp"
#include "host_sim/tcp_server_link.hpp"
#include "host_sim/world.hpp"

namespace moldloft::host_sim {

namespace {

constexpr hal::Duration step_time = std::chrono::milliseconds{1};

volatile std::sig_atomic_t asked_to_end = 0;
void ask_to_end(int) { asked_to_end = 1; }

int failed(const SimError& error) {
  fmt::print(stderr, "moldloft-sim devices: {}\n", error.what);
  return 1;
}

void catch_signals() {
  struct sigaction action {};
  action.sa_handler = ask_to_end;
  ::sigaction(SIGINT, &action, nullptr);
  ::sigaction(SIGTERM, &action, nullptr);
}

}  // namespace

int run_devices(const DeviceOptions& options) {
  const auto plate = placed_plate(options.cell);
  if (!plate) return failed(plate.error());
  const auto scanner = TcpServerLink::listen_on(options.scanner_port);
  if (!scanner) return failed(scanner.error());
  const auto robot = PtyLink::create(options.robot_pty);
  if (!robot) return failed(robot.error());

  if (!options.cell_toml.empty()) {
    const CellAddresses here{.scanner_port = (*scanner)->port(), .robot_device = (*robot)->path()};
    const auto written = firmware_like::write_file(options.cell_toml, cell_toml(options.cell, *plate, here));
    if (!written) return failed({written.error().what});
  }

  catch_signals();
  SimulatedWorld world(options.cell, *plate, **scanner, **robot);
  fmt::print("ready: scanner 127.0.0.1:{} robot {} plate {} seed {}\n", (*scanner)->port(), (*robot)->path(),
             plate->plate->name(), options.cell.seed);
  std::fflush(stdout);

  hal::SteadyClock clock;
  hal::Instant next = clock.now();
  while (asked_to_end == 0) {
    const hal::Instant now = clock.now();
    world.step(now);
    next = std::max(next + step_time, now);  // casting a frame takes several steps: they are not caught up
    clock.sleep_until(next);
  }
  const auto times = world.times();
  fmt::print("ended: {} motions, {} exposures, {:.1f} s from first command to last done, idle {:.1f} %\n",
             world.robot().counters().motions, world.scanner().counters().exposures,
             std::chrono::duration<double>(times.total).count(), 100 * times.idle_fraction());
  return 0;
}

}  // namespace moldloft::host_sim
