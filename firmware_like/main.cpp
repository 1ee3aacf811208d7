// The controller program.
#include <fmt/format.h>

#include <CLI/CLI.hpp>

#include "firmware_like/export_command.hpp"
#include "firmware_like/latency_command.hpp"
#include "firmware_like/machines.hpp"
#include "firmware_like/operator_channel.hpp"
#include "firmware_like/replay_command.hpp"
#include "firmware_like/report_command.hpp"
#include "firmware_like/run_command.hpp"

using namespace moldloft::firmware_like;

int main(int argc, char** argv) {
  CLI::App app{"Moldloft: measures formed ship plates with a laser-stripe scanner on a robot"};
  app.require_subcommand(1);

  RunOptions run;
  auto* run_command = app.add_subcommand("run", "measure one plate on the cell's devices");
  run_command->add_option("config", run.config_path, "the cell's configuration (TOML)")->required();
  run_command->add_option("--out", run.out, "the run's folder; default: a new one under out/");
  run_command->add_flag("--resume", run.resume, "go on with the run in --out after its last stored shot");

  run_command->add_flag(
      "--resume-held", run.resume_held,
      "begin the run in --out or go on with it, but come up held until `moldloft tell unhold`");
  run_command->add_option("--control", run.control,
                          "socket for `moldloft tell`; with it what waits for a person is waited for");
  run_command->add_option("--go-on", run.go_on,
                          "for what starts this program: the command to advise when the run can go on");

  TellOptions tell;
  auto* tell_command = app.add_subcommand("tell", "command a running cell, or ask for its status");
  tell_command->add_option("command", tell.word, "unhold, hold, stop, abort, clear, status")->required();
  tell_command->add_option("--control", tell.control, "the socket of the running cell")
      ->capture_default_str();

  FitOptions fit;
  auto* fit_command =
      app.add_subcommand("fit", "outline and surface once more from the shots of a stored run");
  fit_command->add_option("run", fit.run, "the run's folder")->required();
  fit_command->add_option("--out", fit.out, "where the results go")->required();

  ExportOptions to_cad;
  auto* export_command = app.add_subcommand("export", "the surface of a run as STEP and IGES files");
  export_command->add_option("run", to_cad.run, "the run's folder, or a surface.json")->required();
  export_command->add_option("--step", to_cad.step, "the STEP file to write (AP242)");
  export_command->add_option("--iges", to_cad.iges, "the IGES file to write (5.3)");

  ReplayOptions replay;
  auto* replay_command = app.add_subcommand("replay", "what a stored run did, in order of time");
  replay_command->add_option("run", replay.run, "the run's folder, or one dump of the flight recorder")
      ->required();
  replay_command->add_flag("--timeline", replay.timeline, "the flight recorder's dumps, tick by tick");
  replay_command->add_option("--ticks", replay.ticks, "how many before the trigger")
      ->capture_default_str()
      ->check(CLI::Range(1, 1'000'000));
  replay_command->add_flag("--all", replay.all_ticks, "all ticks that a dump holds");

  LatencyOptions latency;
  auto* latency_command = app.add_subcommand("latency", "timing self-test with fit and recorder busy");
  latency_command->add_option("--duration", latency.duration_s, "of the whole measurement, s")
      ->capture_default_str();
  latency_command->add_option("--compare", latency.compare, "cyclictest: run it in turns with ours");
  latency_command->add_flag("--json", latency.json, "print the figures as JSON, and nothing else");
  latency_command->add_option("--out", latency.out,
                              "folder for the run store and the report; default: none is kept");
  latency_command->add_option("--tick", latency.tick_us,
                              "of the scheduler, us; default: the configuration's");
  latency_command->add_option("--config", latency.config,
                              "a cell's configuration (TOML), for [realtime] and scanner");

  ReportOptions report;
  auto* report_command =
      app.add_subcommand("report", "result and timing of a stored run, and its report.html made anew");
  report_command->add_option("run", report.run, "the run's folder")->required();

  auto* machines_command = app.add_subcommand("machines", "print the state machines as Mermaid diagrams");

  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    return app.exit(e) == 0 ? exit_done : exit_failed;
  }
  if (*run_command) return run_cell(run);
  if (*tell_command) return tell_cell(tell);
  if (*fit_command) return fit_run(fit);
  if (*export_command) return export_run(to_cad);
  if (*replay_command) return replay_run(replay);
  if (*latency_command) return measure_latency(latency);
  if (*report_command) return report_run(report);
  if (*machines_command) {
    fmt::print("{}", machine_diagrams());
    return exit_done;
  }
  return exit_failed;
}
