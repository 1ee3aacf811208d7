#include "firmware_like/commands/command_table.hpp"

#include "firmware_like/commands/check_command.hpp"
#include "firmware_like/commands/export_command.hpp"
#include "firmware_like/commands/fit_command.hpp"
#include "firmware_like/commands/inspect_command.hpp"
#include "firmware_like/commands/latency_command.hpp"
#include "firmware_like/commands/machines.hpp"
#include "firmware_like/commands/option_values.hpp"
#include "firmware_like/commands/replay_command.hpp"
#include "firmware_like/commands/report_command.hpp"
#include "firmware_like/commands/run_command.hpp"
#include "firmware_like/config/task_table.hpp"
#include "firmware_like/gateway/operator_channel.hpp"
#include "firmware_like/inspection/inspection.hpp"
#include "firmware_like/process/complaint.hpp"
#include "firmware_like/process/console.hpp"

#include <array>
#include <memory>

namespace moldloft::firmware_like {
namespace {

// The options live as long as somebody may run the command.
template <typename Options>
RunCommand with(const std::shared_ptr<Options>& options, int (*run)(const Options&)) {
  return [options, run] { return run(*options); };
}

// Given or not given makes a difference.
void add_text(CLI::App& to, const char* name, std::optional<std::string>& value, const char* help) {
  to.add_option_function<std::string>(
      name, [&value](const std::string& text) { value = text; }, help);
}

RunCommand add_run(CLI::App& to) {
  const auto run = std::make_shared<RunOptions>();
  to.add_option("config", run->config_path, "the cell's configuration (TOML)")->required();
  to.add_option("--out", run->out, "the run's folder; default: a new one under out/");
  add_text(to, "--plate", run->plate, "the plate's name in all results; default: the folder's");
  add_text(to, "--remark", run->remark, "one line of yours that goes into all results");
  to.add_flag("--resume", run->resume, "go on with the run in --out after its last stored shot");
  to.add_flag("--resume-held", run->resume_held,
              "begin or go on with the run in --out, held until told unhold");
  to.add_option("--control", run->control, "socket for `moldloft tell`; with it a person is waited for");
  to.add_option("--go-on", run->go_on, "of what starts this program: the command to advise");
  to.add_flag("--quiet", run->quiet, "no progress: only errors and the last line");
  return with(run, run_cell);
}

RunCommand add_check(CLI::App& to) {
  const auto check = std::make_shared<CheckOptions>();
  to.add_option("config", check->config, "the cell's configuration (TOML)")->required();
  to.add_flag("--connect", check->connect, "ask both devices too: one exposure, no motion");
  return with(check, check_cell);
}

RunCommand add_tell(CLI::App& to) {
  const auto tell = std::make_shared<TellOptions>();
  to.add_option("command", tell->word, operator_words())->required();
  to.add_option("--control", tell->control,
                "the socket of the running cell; default: of the only one that runs");
  return with(tell, tell_cell);
}

RunCommand add_fit(CLI::App& to) {
  const auto fit = std::make_shared<FitOptions>();
  to.add_option("run", fit->run, "the run's folder")->required();
  to.add_option("--out", fit->out, "where the results go")->required();
  to.add_flag("--force", fit->force, "write over another run's results");
  return with(fit, fit_run);
}

RunCommand add_export(CLI::App& to) {
  const auto to_cad = std::make_shared<ExportOptions>();
  to.add_option("run", to_cad->run, "the run's folder, or a surface.json")->required();
  to.add_option("--step", to_cad->step, "the STEP file to write (AP242)");
  to.add_option("--iges", to_cad->iges, "the IGES file to write (5.3)");
  to.add_flag("--force", to_cad->force, "write over a file that says something else");
  return with(to_cad, export_run);
}

RunCommand add_replay(CLI::App& to) {
  const auto replay = std::make_shared<ReplayOptions>();
  to.add_option("run", replay->run, "the run's folder, or one dump of the flight recorder")->required();
  to.add_flag("--timeline", replay->timeline, "the flight recorder's dumps, tick by tick");
  add_number_with_default(to, "--ticks", replay->ticks, {1, 1'000'000}, "how many before the trigger");
  to.add_flag("--all", replay->all_ticks, "all ticks that a dump holds");
  return with(replay, replay_run);
}

RunCommand add_latency(CLI::App& to) {
  const auto latency = std::make_shared<LatencyOptions>();
  add_number_with_default(to, "--duration", latency->duration_s, {1.0, longest_latency_s, "s"},
                          "of the whole measurement, s");
  to.add_option("--compare", latency->compare, "cyclictest: run it in turns with ours");
  to.add_flag("--json", latency->json, "print the figures as JSON, and nothing else");
  to.add_option("--out", latency->out, "folder for the run store and the report; default: none is kept");
  add_number(to, "--tick", latency->tick_us,
             {static_cast<int>(shortest_tick / 1us), static_cast<int>(longest_tick / 1us), "us"},
             "of the scheduler, us; default: the configuration's");
  to.add_option("--config", latency->config, "a cell's configuration (TOML), for [realtime] and scanner");
  return with(latency, measure_latency);
}

RunCommand add_report(CLI::App& to) {
  const auto report = std::make_shared<ReportOptions>();
  to.add_option("run", report->run, "the run's folder")->required();
  return with(report, report_run);
}

RunCommand add_inspect(CLI::App& to) {
  const auto inspect = std::make_shared<InspectOptions>();
  to.add_option("run", inspect->run, "the run's folder")->required();
  to.add_option("--against", inspect->design, "STEP, IGES, surface.json, points, template list, or a run")
      ->required();
  to.add_option("--align", inspect->align, alignment_names())->default_str("best");
  to.add_option("--limit", inspect->limit, "mm that may differ: 3, or -2,3; default: nothing is judged");
  to.add_option("--border-limit", inspect->border_limit, "the same near the border; default: as --limit");
  to.add_option("--region", inspect->regions,
                "NAME:x0,y0,x1,y1:LIMIT, in the design's x and y; may be repeated");
  add_number_with_default(to, "--border-width", inspect->border_width_mm, {0.0, 10'000.0, "mm"},
                          "what counts as border, mm");
  to.add_option("--outline", inspect->outline, "use or ignore: of a plate that still has its margin")
      ->default_str("use");
  to.add_option("--datum", inspect->datum, "for --align datum: lines of x y z measured, x y z designed");
  to.add_option("--unit", inspect->unit, "of a list of points: mm, cm, m, in or ft");
  add_number_with_default(to, "--frames", inspect->frames, {1, 99},
                          "frame lines, where the design names none");
  to.add_option("--out", inspect->out, "where the results go; default: the run's folder");
  to.add_flag("--force", inspect->force, "compare also what looks like another plate, or a run that is held");
  return with(inspect, inspect_run);
}

RunCommand add_machines(CLI::App&) {
  return [] {
    show(cell_diagrams() + "\n" + driver_diagrams());
    return static_cast<int>(exit_done);
  };
}

constexpr std::array<Command, 10> table{{
    {"run", "measure one plate on the cell's devices", add_run},
    {"check", "all that can be known before a plate is measured", add_check},
    {"tell", "command a running cell, or ask for its status", add_tell},
    {"fit", "outline and surface once more from the shots of a stored run", add_fit},
    {"export", "the surface of a run as STEP and IGES files", add_export},
    {"replay", "what a stored run did, in order of time", add_replay},
    {"latency", "timing self-test with fit and recorder busy", add_latency},
    {"report", "result and timing of a stored run, and its report.html made anew", add_report},
    {"inspect", "where a measured plate differs from its design", add_inspect},
    {"machines", "print the state machines as Mermaid diagrams", add_machines},
}};

}  // namespace

std::span<const Command> commands() { return table; }

}  // namespace moldloft::firmware_like
