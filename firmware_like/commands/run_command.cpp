#include "firmware_like/commands/run_command.hpp"

#include "firmware_like/config/device_makes.hpp"
#include "firmware_like/config/plate_name.hpp"
#include "firmware_like/controller/cell_claim.hpp"
#include "firmware_like/controller/control_loop.hpp"
#include "firmware_like/controller/result_of.hpp"
#include "firmware_like/gateway/display.hpp"
#include "firmware_like/gateway/operator_channel.hpp"
#include "firmware_like/gateway/service_notify.hpp"
#include "firmware_like/gateway/service_thread.hpp"
#include "firmware_like/process/complaint.hpp"
#include "firmware_like/process/console.hpp"
#include "firmware_like/process/stop_signals.hpp"
#include "firmware_like/realtime/control_thread.hpp"
#include "firmware_like/report/result_files.hpp"
#include "firmware_like/report/result_table.hpp"
#include "firmware_like/report/timing_table.hpp"
#include "firmware_like/run/recorder_thread.hpp"
#include "hal/base/printable_text.hpp"
#include "hal/links/cable.hpp"
#include "hal/links/serial_link.hpp"
#include "hal/links/tcp_link.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <ctime>
#include <iterator>
#include <optional>
#include <random>

namespace moldloft::firmware_like {
namespace {

// A result's table is a courtesy: the run has to end whether it is read or not.
constexpr auto patience_with_a_reader = std::chrono::seconds{5};

std::string memory_line(const Controller& controller) {
  std::string line = "memory plan:";
  for (const auto& item : controller.memory())
    line += fmt::format(" {} {:.1f} MiB,", item.subsystem, static_cast<double>(item.plan_bytes) / (1 << 20));
  return line +
         fmt::format(" {:.1f} MiB in all", static_cast<double>(total_plan(controller.memory())) / (1 << 20));
}

// What the run begins with: how much memory it has planned for, and what the operating system has not given.
std::string head_lines(const Controller& controller, const RunConditions& conditions) {
  std::string lines = memory_line(controller);
  for (const auto& complaint : complaints(conditions.setup))
    lines += "\n" + marked(Priority::warning, "not real-time: " + complaint);
  const Verdict verdict = verdict_on(conditions.environment, conditions.setup, conditions.realtime);
  if (!verdict.representative)
    lines += "\n" + marked(Priority::notice, "timing is not representative: " + verdict.why());
  return lines;
}

// A name as it can be typed into a shell, on one line.
std::string shell_word(const std::string& name) {
  constexpr std::string_view harmless =
      "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-./:=@%+,";
  if (!name.empty() && name.find_first_not_of(harmless) == std::string::npos) return name;
  const bool has_control = std::ranges::any_of(name, [](unsigned char c) { return c < ' ' || c == 0x7F; });
  std::string word = has_control ? "$'" : "'";
  for (const char c : name) {
    const auto byte = static_cast<unsigned char>(c);
    if (byte < ' ' || byte == 0x7F) {
      word += fmt::format("\\{:03o}", byte);
    } else if (c == '\'') {
      word += has_control ? "\\'" : "'\\''";
    } else if (c == '\\' && has_control) {
      word += "\\\\";
    } else {
      word += c;
    }
  }
  return word + "'";
}

// One line for a run that did not complete: what happened, what is saved where, how to go on.
std::string how_it_ended(const Controller& controller, const RunResult& result, const RunOptions& options,
                         const std::string& folder) {
  const auto& cell = controller.cell();
  const bool is_stopped = result.outcome == Outcome::stopped;
  const std::string what =
      fmt::format("{}: {}", to_string(result.outcome), is_stopped ? "the arm stands" : result.message);
  // By the audit, when there is nothing left to measure.
  const bool untrusted = result.outcome == Outcome::held && cell.state() == tasks::CellState::complete;
  if (untrusted || (cell.cause() == tasks::HoldCause::measurement && !is_stopped)) {
    return fmt::format("{}. What was measured is saved in {} (overview.svg shows it); then begin a new run",
                       what, folder);
  }
  const std::string saved =
      controller.recorder().store_failed() ? "What was stored before is kept" : "Everything so far is saved";
  const bool too_small = cell.cause() == tasks::HoldCause::plan && cell.state() == tasks::CellState::held;
  const std::string again = options.go_on.empty()
                                ? fmt::format("moldloft run {} --out {} --resume",
                                              shell_word(options.config_path), shell_word(folder))
                                : options.go_on;
  return fmt::format("{}. {}; to go on{}: {}", what, saved, too_small ? " after that" : "", again);
}

// Nothing is left to measure: neither the devices nor the folder are touched. A service manager that waits for READY
// would otherwise take the end for a failure, and start again and again.
int say_complete(const std::filesystem::path& out) {
  const std::string line = fmt::format(
      "{0}: this run is complete, nothing is left to measure; `moldloft report {0}` shows it, another plate "
      "needs another --out",
      out.string());
  ServiceNotify{}.ready(line);
  complain(line, "moldloft", Priority::notice);
  return exit_done;
}

// Stopped is what somebody has meant; held and aborted is what somebody has to see to.
Priority priority_of(int exit_code) {
  return exit_code == exit_stopped ? Priority::notice
         : exit_code == exit_held  ? Priority::warning
                                   : Priority::error;
}

// The same for a run that ended before the arm was sent anywhere: nothing was measured, nothing is kept.
std::string why_refused(const Controller& controller) {
  const auto& cell = controller.cell();
  if (cell.state() == tasks::CellState::stopped)
    return "stopped before anything was measured; nothing is kept";
  return fmt::format("{}; nothing was measured", cell.why().view());
}

// Wire ids of this run must differ from those of any run before on the same scanner.
std::uint32_t fresh_epoch() {
  std::random_device device;
  return (device() ^ static_cast<std::uint32_t>(std::time(nullptr))) & 0xFFFFFu;
}

// A SYN that answers an earlier program must not pass for an answer to this one.
std::uint32_t fresh_nonce() { return std::random_device{}() & hal::robot_line::largest_nonce; }

std::expected<RunNames, std::string> names_given(const RunOptions& options) {
  RunNames names;
  if (options.plate) {
    auto plate = one_line(*options.plate, "--plate", longest_plate_name);
    if (!plate) return std::unexpected{plate.error()};
    names.plate = std::move(*plate);
  }
  if (options.remark) {
    auto remark = one_line(*options.remark, "--remark", longest_remark);
    if (!remark) return std::unexpected{remark.error()};
    names.remark = std::move(*remark);
  }
  return names;
}

std::optional<std::string> contradiction_in(const RunOptions& options) {
  if (options.resume && options.out.empty()) return "--resume: give the run's folder with --out";
  if (options.resume_held && (options.out.empty() || options.control.empty()))
    return "--resume-held: give the run's folder with --out, and --control: nobody could say unhold";
  return std::nullopt;
}

// The run, from the first tick to the cell's rest, with all that goes on beside it.
RunConditions run_beside_threads(Controller& controller, const CellConfig& config, const RunFolder& folder,
                                 const RunOptions& options, OperatorSocket* operator_socket,
                                 std::optional<ServiceThread>& service) {
  RunConditions conditions{config.realtime, read_environment(config.realtime.cpu), {}, {}};
  FlightFiles flight{controller.flight(), folder.path};
  const CrashDump crash{controller.flight(), controller.scheduler(), folder.path};
  const ProcessSetup process{config.realtime};
  ControlThread control{config.realtime, [&] { conditions.control_thread = run_to_rest(controller); }};
  const RecorderThread recorder{controller.recorder(), *folder.store, flight};
  std::optional<OperatorThread> operators;
  if (operator_socket != nullptr) operators.emplace(*operator_socket, controller.cell());
  const Surroundings around{.scanner = place_of(config.scanner.place),
                            .robot = place_of(config.robot.place),
                            .has_operator = operator_socket != nullptr};
  const auto look_at_loop = [&scheduler = controller.scheduler()] {
    return LoopPulse{.ticks = scheduler.heartbeat(), .task = scheduler.name_of(scheduler.running_task())};
  };
  service.emplace(controller.cell(), look_at_loop, folder.path, around);
  conditions.setup = process.rows();
  std::ranges::copy(control.setup(), std::back_inserter(conditions.setup));
  conditions.setup.push_back(check_ordinary_threads(control.id(), config.realtime));
  std::optional<DisplayThread> display;
  if (!options.quiet) display.emplace(controller.cell(), head_lines(controller, conditions), around);
  control.begin();
  control.join();
  service->loop_has_ended();
  return conditions;
}

// For readers of the journal; on a terminal and in the report the timing says the same.
void warn_of_health(const RunResult& result) {
  if (!stderr_is_journal()) return;
  const std::string missed = missed_ticks_line(result.timing), lost = losses_line(result.timing);
  if (!missed.empty()) complain(missed, "moldloft", Priority::warning);
  if (!lost.empty())
    complain(
        fmt::format("lost on the way: {}: look at cables, earthing and how fast the devices answer", lost),
        "moldloft", Priority::warning);
}

// Under the journal, and where no table is printed.
void say_findings(const RunResult& result, bool quiet) {
  if (!quiet && !stderr_is_journal()) return;
  for (const Finding& finding : result.findings)
    complain(fmt::format("{}: {}", to_string(finding.gravity), finding.text), "moldloft", Priority::warning);
}

// What is left behind and said when the cell has come to rest.
int wind_up(Controller& controller, RunFolder folder, const RunOptions& options, bool resumed,
            const RunConditions& conditions) {
  const RunResult result = result_of(
      controller,
      {.plate = folder.names.plate, .seed = {}, .begun = begun_of(folder), .remark = folder.names.remark},
      &conditions);
  const int code = exit_code(result.outcome);
  warn_of_health(result);
  if (!resumed && !controller.cell().has_driven()) {
    discard_run(std::move(folder));
    return complain(why_refused(controller), "moldloft", priority_of(code)),
           code == exit_aborted ? exit_failed : code;
  }
  const bool store_failed = controller.recorder().store_failed();
  if (store_failed) {
    complain(
        fmt::format("{}; what came after that is not saved", controller.recorder().store_error().view()));
  }
  if (const auto back = bring_back(folder); !back)
    complain(back.error().what);
  else if (*back)
    complain(fmt::format("{}: was removed during the run; made again, with all that was recorded",
                         folder.path.string()));
  const auto written = write_results(result, folder);
  if (!written) complain(written.error().what);
  if (!is_measured(result.outcome))
    complain(how_it_ended(controller, result, options, folder.path.string()), "moldloft", priority_of(code));
  if (!written) return exit_failed;
  if (!is_measured(result.outcome)) return say_findings(result, true), code;
  say_findings(result, options.quiet);
  const std::string answer = options.quiet
                                 ? fmt::format("{}: {}\n", to_string(result.outcome), folder.path.string())
                                 : result_table(result, folder.path.string()) + timing_lines(result.timing);
  if (!show_within(patience_with_a_reader, answer))
    complain(fmt::format("{}; the table cannot be written to standard output: moldloft report {}",
                         to_string(result.outcome), folder.path.string()));
  return store_failed ? exit_failed : code;
}

}  // namespace

int run_cell(const RunOptions& options) {
  const auto config = load_config(options.config_path);
  if (!config) return complain_all(config.error().what);
  if (const auto why = contradiction_in(options)) return complain(*why);
  const auto names = names_given(options);
  if (!names) return complain(names.error());
  const bool resume = options.resume || (options.resume_held && holds_run(options.out));
  if (resume && holds_complete_run(options.out)) return say_complete(options.out);
  StopSignals signals;
  const auto devices = claim_cell(*config);
  if (!devices) return complain(devices.error());
  std::optional<OperatorSocket> operator_socket;
  if (!options.control.empty()) {
    auto opened = OperatorSocket::open(options.control);
    if (!opened) return complain(opened.error());
    operator_socket.emplace(std::move(*opened));
  }
  auto folder = resume ? resume_run(options.out, config->text, *names)
                       : create_run(options.out, config->text, *make_of(config->scanner).codec,
                                    RunKind::measured, *names);
  if (!folder) return complain(folder.error().what);

  hal::SteadyClock clock;
  const auto scanner_link = make_link(config->scanner.place), robot_link = make_link(config->robot.place);
  const auto controller =
      std::make_unique<Controller>(*config, clock, *scanner_link, *robot_link,
                                   ControllerOptions{.archive = folder->archive.get(),
                                                     .epoch = fresh_epoch(),
                                                     .nonce = fresh_nonce(),
                                                     .begin_held = options.resume_held,
                                                     .attended = operator_socket.has_value()});
  signals.stops(controller.get());
  std::optional<ServiceThread> service;
  RunConditions conditions = run_beside_threads(*controller, *config, *folder, options,
                                                operator_socket ? &*operator_socket : nullptr, service);
  signals.stops(nullptr);
  conditions.unsaid_lines = unsaid();
  return wind_up(*controller, std::move(*folder), options, resume, conditions);
}

}  // namespace moldloft::firmware_like
