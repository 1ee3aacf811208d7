// The controller program.
#include "firmware_like/commands/check_command.hpp"
#include "firmware_like/commands/command_line.hpp"
#include "firmware_like/commands/export_command.hpp"
#include "firmware_like/commands/fit_command.hpp"
#include "firmware_like/commands/latency_command.hpp"
#include "firmware_like/commands/machines.hpp"
#include "firmware_like/commands/option_values.hpp"
#include "firmware_like/commands/replay_command.hpp"
#include "firmware_like/commands/report_command.hpp"
#include "firmware_like/commands/run_command.hpp"
#include "firmware_like/config/task_table.hpp"
#include "firmware_like/gateway/operator_channel.hpp"
#include "firmware_like/process/build_info.hpp"
#include "firmware_like/process/complaint.hpp"
#include "firmware_like/process/console.hpp"

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include <sstream>
#include <system_error>

using namespace moldloft::firmware_like;
using namespace std::chrono_literals;

namespace {

int run_command_line(int argc, char** argv) {
  CLI::App app{"Moldloft: measures formed ship plates with a laser-stripe scanner on a robot", "moldloft"};
  app.set_version_flag("--version", "moldloft " + version_text(), "version, commit and compiler");
  app.require_subcommand(1);

  RunOptions run;
  auto* run_command = app.add_subcommand("run", "measure one plate on the cell's devices");
  run_command->add_option("config", run.config_path, "the cell's configuration (TOML)")->required();
  run_command->add_option("--out", run.out, "the run's folder; default: a new one under out/");
  run_command->add_option_function<std::string>(
      "--plate", [&](const std::string& name) { run.plate = name; },
      "the plate's name in all results; default: the folder's");
  run_command->add_option_function<std::string>(
      "--remark", [&](const std::string& text) { run.remark = text; },
      "one line of yours that goes into all results");
  run_command->add_flag("--resume", run.resume, "go on with the run in --out after its last stored shot");

  run_command->add_flag("--resume-held", run.resume_held,
                        "begin or go on with the run in --out, held until told unhold");
  run_command->add_option("--control", run.control,
                          "socket for `moldloft tell`; with it a person is waited for");
  run_command->add_option("--go-on", run.go_on, "of what starts this program: the command to advise");
  run_command->add_flag("--quiet", run.quiet, "no progress: only errors and the last line");

  CheckOptions check;
  auto* check_command = app.add_subcommand("check", "all that can be known before a plate is measured");
  check_command->add_option("config", check.config, "the cell's configuration (TOML)")->required();
  check_command->add_flag("--connect", check.connect, "ask both devices too: one exposure, no motion");

  TellOptions tell;
  auto* tell_command = app.add_subcommand("tell", "command a running cell, or ask for its status");
  tell_command->add_option("command", tell.word, operator_words())->required();
  tell_command->add_option("--control", tell.control,
                           "the socket of the running cell; default: of the only one that runs");

  FitOptions fit;
  auto* fit_command =
      app.add_subcommand("fit", "outline and surface once more from the shots of a stored run");
  fit_command->add_option("run", fit.run, "the run's folder")->required();
  fit_command->add_option("--out", fit.out, "where the results go")->required();
  fit_command->add_flag("--force", fit.force, "write over another run's results");

  ExportOptions to_cad;
  auto* export_command = app.add_subcommand("export", "the surface of a run as STEP and IGES files");
  export_command->add_option("run", to_cad.run, "the run's folder, or a surface.json")->required();
  export_command->add_option("--step", to_cad.step, "the STEP file to write (AP242)");
  export_command->add_option("--iges", to_cad.iges, "the IGES file to write (5.3)");
  export_command->add_flag("--force", to_cad.force, "write over a file that says something else");

  ReplayOptions replay;
  auto* replay_command = app.add_subcommand("replay", "what a stored run did, in order of time");
  replay_command->add_option("run", replay.run, "the run's folder, or one dump of the flight recorder")
      ->required();
  replay_command->add_flag("--timeline", replay.timeline, "the flight recorder's dumps, tick by tick");
  add_number_with_default(*replay_command, "--ticks", replay.ticks, {1, 1'000'000},
                          "how many before the trigger");
  replay_command->add_flag("--all", replay.all_ticks, "all ticks that a dump holds");

  LatencyOptions latency;
  auto* latency_command = app.add_subcommand("latency", "timing self-test with fit and recorder busy");
  add_number_with_default(*latency_command, "--duration", latency.duration_s, {1.0, longest_latency_s, "s"},
                          "of the whole measurement, s");
  latency_command->add_option("--compare", latency.compare, "cyclictest: run it in turns with ours");
  latency_command->add_flag("--json", latency.json, "print the figures as JSON, and nothing else");
  latency_command->add_option("--out", latency.out,
                              "folder for the run store and the report; default: none is kept");
  add_number(*latency_command, "--tick", latency.tick_us,
             {static_cast<int>(shortest_tick / 1us), static_cast<int>(longest_tick / 1us), "us"},
             "of the scheduler, us; default: the configuration's");
  latency_command->add_option("--config", latency.config,
                              "a cell's configuration (TOML), for [realtime] and scanner");

  ReportOptions report;
  auto* report_command =
      app.add_subcommand("report", "result and timing of a stored run, and its report.html made anew");
  report_command->add_option("run", report.run, "the run's folder")->required();

  auto* machines_command = app.add_subcommand("machines", "print the state machines as Mermaid diagrams");

  if (const auto ended = parse_command_line(app, argc, argv)) return *ended;
  if (*run_command) return run_cell(run);
  if (*check_command) return check_cell(check);
  if (*tell_command) return tell_cell(tell);
  if (*fit_command) return fit_run(fit);
  if (*export_command) return export_run(to_cad);
  if (*replay_command) return replay_run(replay);
  if (*latency_command) return measure_latency(latency);
  if (*report_command) return report_run(report);
  if (*machines_command) {
    show(cell_diagrams() + "\n" + driver_diagrams());
    return exit_done;
  }
  return exit_failed;
}

}  // namespace

int main(int argc, char** argv) {
  open_console();
  try {
    return end_of_output(run_command_line(argc, argv), "moldloft");
  } catch (const std::system_error& e) {
    return complain(fmt::format("the system refuses: {}; is a limit of this user too low (ulimit -a)?",
                                e.code().message()));
  } catch (const std::exception& e) {
    return complain(fmt::format("a defect, please report it: {}", e.what()));
  }
}
