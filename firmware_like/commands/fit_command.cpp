#include "firmware_like/commands/fit_command.hpp"

#include "firmware_like/controller/control_loop.hpp"
#include "firmware_like/controller/result_of.hpp"
#include "firmware_like/process/complaint.hpp"
#include "firmware_like/process/console.hpp"
#include "firmware_like/process/json_file.hpp"
#include "firmware_like/report/findings_text.hpp"
#include "firmware_like/report/result_files.hpp"
#include "firmware_like/report/result_table.hpp"
#include "hal/links/cable.hpp"

#include <fmt/format.h>

#include <memory>

namespace moldloft::firmware_like {
namespace {

// One path for a run, however it is named, so that runs can be told apart.
std::string canonical_name(const std::string& run) {
  std::error_code failed;
  const auto place = std::filesystem::canonical(run, failed);
  return failed ? run : place.string();
}

// Made, or there already: empty, with somebody's other files, or with an earlier fit of the same run. What another
// run or its fit has left is not written over.
std::expected<RunFolder, Failure> folder_for_fit(const FitOptions& options) {
  const std::filesystem::path out{options.out};
  const auto refused = [&](std::string_view why) {
    return std::unexpected{Failure{fmt::format("{}: {}", options.out, why)}};
  };
  std::error_code failed;
  if (std::filesystem::equivalent(options.run, out, failed))
    return refused("is the run itself; give another folder with --out");
  failed.clear();
  std::filesystem::create_directories(out, failed);
  if (failed) return refused(fmt::format("cannot be created ({})", failed.message()));
  auto claim = FolderClaim::take(out);
  if (!claim) return std::unexpected{claim.error()};
  const auto before = read_json(out / "summary.json");
  const bool is_ours = before && before->is_object() && before->contains("fitted_from") &&
                       (*before)["fitted_from"] == canonical_name(options.run);
  if (!options.force && (holds_run(out) || (holds_results(out) && !is_ours)))
    return refused("holds another run's results; give another --out, or --force to write over them");
  return RunFolder{.path = out, .claim = std::move(*claim), .store = nullptr, .archive = nullptr};
}

}  // namespace

int fit_run(const FitOptions& options) {
  auto run = open_run(options.run);
  if (!run) return complain(run.error().what);
  const auto text = run->store->meta("config");
  if (!text) return complain(text.error().what);
  const auto config = parse_config(*text, options.run + "/run.db");
  if (!config) return complain_all(config.error().what);

  hal::VirtualClock clock;
  hal::Cable none{clock, {}};  // no devices: nothing is ever sent
  const auto controller =
      std::make_unique<Controller>(*config, clock, none.host(), none.host(),
                                   ControllerOptions{.archive = run->archive.get(), .devices = false});
  run_to_rest(*controller);
  RunResult result = result_of(
      *controller,
      {.plate = run->names.plate, .seed = {}, .begun = begun_of(*run), .remark = run->names.remark});
  result.fitted_from = canonical_name(options.run);
  auto results = folder_for_fit(options);
  if (!results) return complain(results.error().what);
  results->store = std::move(run->store);
  if (const auto written = write_results(result, *results); !written) return complain(written.error().what);
  const int code = exit_code(result.outcome);
  if (!is_measured(result.outcome)) return complain(result.message), say(findings_lines(result)), code;
  show(result_table(result, options.out));
  return code;
}

}  // namespace moldloft::firmware_like
