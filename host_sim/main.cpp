// moldloft-sim: the simulated cell as a program.
#include "firmware_like/commands/command_line.hpp"
#include "firmware_like/commands/option_values.hpp"
#include "firmware_like/config/plate_name.hpp"
#include "firmware_like/gateway/display.hpp"
#include "firmware_like/process/build_info.hpp"
#include "firmware_like/process/complaint.hpp"
#include "firmware_like/process/console.hpp"
#include "firmware_like/report/findings_text.hpp"
#include "firmware_like/report/result_table.hpp"
#include "hal/base/printable_text.hpp"
#include "host_sim/cell/cell_options.hpp"
#include "host_sim/runs/campaign.hpp"
#include "host_sim/runs/day.hpp"
#include "host_sim/runs/device_host.hpp"
#include "host_sim/runs/hard_campaign.hpp"
#include "host_sim/runs/judge.hpp"
#include "host_sim/runs/passes.hpp"
#include "host_sim/runs/simulated_run.hpp"

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <span>
#include <sstream>
#include <unistd.h>

using namespace moldloft::host_sim;
using moldloft::firmware_like::add_number_with_default;
using moldloft::firmware_like::say;
using moldloft::firmware_like::show;

namespace {

// What was read of a mesh, and what was repaired of it.
void say_remarks(const PlateInstance& place) {
  const auto& remarks = place.plate->remarks();
  if (!remarks.empty()) say(fmt::format("plate {}: {}\n", place.plate->name(), remarks));
}

int judge_command(const std::string& folder, const CellDescription& cell) {
  const auto plate = placed_plate(cell);
  if (plate) say_remarks(*plate);
  const auto verdict = plate ? judge_run(folder, *plate) : std::unexpected(plate.error());
  if (!verdict) {
    say(fmt::format("moldloft-sim judge: {}\n", moldloft::hal::printable(verdict.error().what)));
    return 1;
  }
  show(fmt::format("plate {} seed {}, {} points\n", moldloft::hal::printable(cell.plate), cell.seed,
                   verdict->points));
  show(fmt::format("{:<24}{:>10.4f} mm\n", "truth.normal_max", verdict->normal_max_mm));
  show(fmt::format("{:<24}{:>10.4f} mm\n", "truth.normal_rms", verdict->normal_rms_mm));
  show(fmt::format("{:<24}{:>10.4f} mm\n", "truth.outline_max", verdict->outline_max_mm));
  show(fmt::format("{:<24}{:>10.4f} mm\n", "truth.corner_max", verdict->corner_max_mm));
  return 0;
}

int cell_command(SimulatedRunOptions& options, bool quiet) {
  using namespace moldloft::firmware_like;
  options.on_plate = say_remarks;
  const bool terminal = !quiet && renews_lines(STDERR_FILENO, std::getenv("TERM"));
  if (terminal) {
    options.on_progress = [](const moldloft::tasks::CellProgress& p) {
      const auto columns = terminal_columns(STDERR_FILENO, std::getenv("COLUMNS"));
      say(fmt::format("\r\x1b[K{}", progress_line_within(std::max<std::size_t>(columns, 2) - 1, p)));
    };
  }
  const auto run = simulate(options);
  if (terminal && run) say(fmt::format("\n"));
  if (!run) {
    say(fmt::format("moldloft-sim cell: {}\n", moldloft::hal::printable(run.error().what)));
    return 1;
  }
  const auto& result = run->result;
  if (!is_measured(result.outcome)) {
    say(fmt::format("moldloft-sim cell: {}: {}\n", to_string(result.outcome),
                    moldloft::hal::printable(result.message)) +
        findings_lines(result));
    return run->exit_code;
  }
  if (quiet) say(findings_lines(result));
  show(quiet ? fmt::format("{}: {}\n", to_string(result.outcome), run->folder.string())
             : result_table(result, run->folder.string()));
  return run->exit_code;
}

void add_cell_command(CLI::App& app, SimulatedRunOptions& options, bool& quiet) {
  auto* command = app.add_subcommand("cell", "the whole cell in one thread: controller, cables and devices");
  add_cell_options(*command, options.cell);
  add_fault_option(*command, options.cell);
  command->add_option("--out", options.out, "the run's folder; default: a new one under out/");
  const auto add_text = [&](const char* option, std::string& text, std::size_t longest, const char* about) {
    command->add_option_function<std::string>(
        option,
        [&text, option, longest](const std::string& given) {
          const auto line = moldloft::firmware_like::one_line(given, option, longest);
          if (!line) throw CLI::ValidationError(line.error());
          text = *line;
        },
        about);
  };
  add_text("--name", options.name, moldloft::firmware_like::longest_plate_name,
           "the plate's name in all results; default: its shape and seed");
  add_text("--remark", options.remark, moldloft::firmware_like::longest_remark,
           "one line of yours that goes into all results");
  command->add_flag("--quiet", quiet, "no progress: only what went wrong, and the last line");
  command
      ->add_option_function<std::string>(
          "--clock", [&](const std::string& c) { options.real_time = c == "real"; },
          "virtual: as fast as it goes; real: paced by the wall clock")
      ->check(CLI::IsMember({"virtual", "real"}));
}

CLI::Validator all_or_one_of(std::span<const std::string_view> names, std::string_view also = "all") {
  const auto check = [names, also](const std::string& word) {
    if (word == "all" || word == also || std::ranges::find(names, word) != names.end()) return std::string{};
    return fmt::format("'{}' given; all, or one of {} is wanted", word, fmt::join(names, ", "));
  };
  return {check, ""};
}

void add_campaign_command(CLI::App& app, CampaignOptions& options) {
  auto* command = app.add_subcommand("campaign", "many simulated runs: shapes x outlines x seeds");
  command
      ->add_option("--plates", options.plates,
                   "all, one shape, or hard: whatever goes wrong, and a judge of honesty")
      ->capture_default_str()
      ->check(all_or_one_of(shape_names(), hard_plates));
  command->add_option("--outlines", options.outlines, "all, or one outline")
      ->capture_default_str()
      ->check(all_or_one_of(outline_names()));
  const auto read_seeds = [&options](const std::string& word) {
    const auto seeds = seeds_from(word);
    if (!seeds) throw CLI::ValidationError("--seeds", seeds.error().what);
    options.seeds = *seeds;
  };
  command->add_option_function<std::string>("--seeds", read_seeds, "A..B or A; of hard 1..400")
      ->default_str("1..3");
  command->add_option("--out", options.out, "keep the run folders here");
  command->add_flag("--json", options.json, "an array of objects instead of the table");
}

void add_passes_command(CLI::App& app, PassesOptions& options) {
  auto* command =
      app.add_subcommand("passes", "a plate formed step by step, each pass measured and inspected");
  add_cell_options(*command, options.cell);
  add_number_with_default(*command, "--passes", options.passes, {1, 50}, "how many");
  add_number_with_default(*command, "--limit", options.limit_mm, {0.001, 1000.0, "mm"},
                          "what may differ, mm");
  command->add_option("--out", options.out, "a folder for the passes")->required();
}

void add_day_command(CLI::App& app, DayOptions& options) {
  auto* command =
      app.add_subcommand("day", "plate after plate in virtual time, and what must not grow meanwhile");
  add_cell_options(*command, options.cell);
  add_number_with_default(*command, "--hours", options.hours, {0.01, 1e4, "h"}, "of cell time");
  add_number_with_default(*command, "--every", options.every_s, {0.0, 86'400.0, "s"},
                          "seconds from one plate's start to the next");
  add_number_with_default(*command, "--rows", options.rows, {1, 1000}, "of the table");
  command->add_flag("--json", options.json, "one object instead of the table");
}

}  // namespace

namespace {

int run_command_line(int argc, char** argv) {
  CLI::App app{"The simulated cell of Moldloft", "moldloft-sim"};
  app.set_version_flag("--version", "moldloft-sim " + moldloft::firmware_like::version_text(),
                       "version, commit and compiler");
  app.require_subcommand(1);

  DeviceOptions devices;
  auto* devices_command =
      app.add_subcommand("devices", "serve scanner and robot in real time until interrupted");
  add_cell_options(*devices_command, devices.cell);
  add_fault_option(*devices_command, devices.cell);
  add_number_with_default(*devices_command, "--scanner-port", devices.scanner_port, {0, 65535},
                          "loopback TCP port, 0 for any");
  auto* pty = devices_command->add_option("--robot-pty", devices.robot_pty, "name for the robot's terminal")
                  ->capture_default_str();
  auto* serial = devices_command
                     ->add_option("--robot-serial", devices.robot_serial,
                                  "serve the robot on this serial port instead, 115200 baud")
                     ->excludes(pty);
  devices_command
      ->add_option_function<std::string>(
          "--robot-port",
          [&devices](const std::string& word) {
            std::uint16_t port = 0;
            const moldloft::firmware_like::Limits<std::uint16_t> limits{0, 65535};
            if (!read_number(word, limits, port))
              throw CLI::ValidationError(out_of_limits("--robot-port", word, limits));
            devices.robot_port = port;
          },
          "serve the robot's lines on this loopback TCP port instead, 0 for any")
      ->type_name("INT in [0 - 65535]")
      ->excludes(pty)
      ->excludes(serial);
  devices_command
      ->add_option("--controller-serial", devices.controller_serial,
                   "the controller's port at the other end of that cable, for --cell")
      ->needs(serial)
      ->capture_default_str();
  devices_command->add_flag("--log", devices.log, "a line for each motion that begins and each exposure");
  devices_command->add_option("--cell", devices.cell_toml,
                              "write a configuration that fits these devices to this file");
  devices_command->add_flag("--force", devices.force, "... even over one that was written by hand");

  SimulatedRunOptions run;
  bool quiet = false;
  add_cell_command(app, run, quiet);
  CampaignOptions campaign;
  add_campaign_command(app, campaign);

  PassesOptions passes;
  add_passes_command(app, passes);
  DayOptions day;
  add_day_command(app, day);

  CellDescription judged;
  std::string folder;
  auto* judged_command = app.add_subcommand("judge", "compare a run's results with the truth");
  judged_command->add_option("folder", folder, "the run folder")->required();
  add_cell_options(*judged_command, judged);

  if (const auto ended = moldloft::firmware_like::parse_command_line(app, argc, argv)) return *ended;
  if (devices_command->parsed()) return run_devices(devices);
  if (app.got_subcommand("cell")) return cell_command(run, quiet);
  if (app.got_subcommand("campaign")) return run_campaign(campaign);
  if (app.got_subcommand("passes")) return show_passes(passes);
  if (app.got_subcommand("day")) return show_day(day);
  return judge_command(folder, judged);
}

}  // namespace

int main(int argc, char** argv) {
  moldloft::firmware_like::open_console();
  try {
    return moldloft::firmware_like::end_of_output(run_command_line(argc, argv), "moldloft-sim");
  } catch (const std::exception& e) {
    return moldloft::firmware_like::complain(fmt::format("a defect, please report it: {}", e.what()),
                                             "moldloft-sim");
  }
}
