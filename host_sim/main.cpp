// moldloft-sim: the simulated cell as a program.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>

#include "host_sim/cell_options.hpp"
#include "host_sim/device_host.hpp"
#include "host_sim/judge.hpp"

using namespace moldloft::host_sim;

namespace {

int judge_command(const std::string& folder, const CellDescription& cell) {
  const auto plate = placed_plate(cell);
  const auto verdict = plate ? judge_run(folder, *plate) : std::unexpected(plate.error());
  if (!verdict) {
    fmt::print(stderr, "moldloft-sim judge: {}\n", verdict.error().what);
    return 1;
  }
  fmt::print("plate {} seed {}, {} points\n", cell.plate, cell.seed, verdict->points);
  fmt::print("{:<24}{:>10.4f} mm\n", "truth.normal_max", verdict->normal_max_mm);
  fmt::print("{:<24}{:>10.4f} mm\n", "truth.normal_rms", verdict->normal_rms_mm);
  fmt::print("{:<24}{:>10.4f} mm\n", "truth.outline_max", verdict->outline_max_mm);
  fmt::print("{:<24}{:>10.4f} mm\n", "truth.corner_max", verdict->corner_max_mm);
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{"The simulated cell of Moldloft"};
  app.require_subcommand(1);

  DeviceOptions devices;
  auto* devices_command =
      app.add_subcommand("devices", "serve scanner and robot in real time until interrupted");
  add_cell_options(*devices_command, devices.cell);
  devices_command->add_option("--scanner-port", devices.scanner_port, "loopback TCP port, 0 for any")
      ->capture_default_str();
  devices_command->add_option("--robot-pty", devices.robot_pty, "name for the robot's terminal")
      ->capture_default_str();

  CellDescription judged;
  std::string folder;
  auto* judged_command = app.add_subcommand("judge", "compare a run's results with the truth");
  judged_command->add_option("folder", folder, "the run folder")->required();
  add_cell_options(*judged_command, judged);

  CLI11_PARSE(app, argc, argv);
  if (devices_command->parsed()) return run_devices(devices);
  return judge_command(folder, judged);
}
