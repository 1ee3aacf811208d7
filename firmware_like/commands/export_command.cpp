#include "firmware_like/commands/export_command.hpp"

#include "firmware_like/process/complaint.hpp"
#include "firmware_like/process/console.hpp"
#include "firmware_like/process/json_file.hpp"
#include "firmware_like/process/whole_file.hpp"
#include "firmware_like/results/cad_files.hpp"
#include "firmware_like/results/stored_result.hpp"
#include "firmware_like/results/summary.hpp"
#include "firmware_like/run/surface_file.hpp"
#include "hal/base/printable_text.hpp"

#include <fmt/format.h>

namespace moldloft::firmware_like {
namespace {

namespace fs = std::filesystem;

std::unexpected<Failure> error(std::string what) { return std::unexpected(Failure{std::move(what)}); }

std::expected<fs::path, Failure> surface_path(const fs::path& run) {
  std::error_code failed;
  if (!fs::exists(run, failed)) return error(fmt::format("{}: no such run or file", run.string()));
  if (!fs::is_directory(run, failed)) return run;
  if (fs::exists(run / "surface.json", failed)) return run / "surface.json";
  return error(
      fmt::format("{}: holds no surface.json; only a run that completed has a surface", run.string()));
}

// A folder says more of its surface than the surface alone; a file may have come without the rest.
std::expected<CadFacts, Failure> facts_beside(const fs::path& surface) {
  const fs::path summary = surface.parent_path() / "summary.json";
  std::error_code failed;
  if (!fs::exists(summary, failed)) return CadFacts{};
  const auto json = read_json(summary);
  if (!json) return std::unexpected(json.error());
  return cad_facts(named_in(*json));
}

// What the audit does not trust is exported only when somebody insists.
std::expected<void, Failure> trusted(const fs::path& surface, bool insists) {
  std::error_code failed;
  const fs::path summary = surface.parent_path() / "summary.json";
  if (insists || !fs::exists(summary, failed)) return {};
  const auto result = read_result(surface.parent_path());
  if (!result || result->outcome != Outcome::held) return {};
  return error(fmt::format("{}: {}; --force exports it all the same", surface.string(), result->message));
}

std::expected<void, Failure> exported(const ExportOptions& options) {
  if (options.step.empty() && options.iges.empty())
    return error("export: say where to with --step FILE, --iges FILE or both");
  const auto path = surface_path(options.run);
  if (!path) return std::unexpected(path.error());
  const auto surface = read_surface(*path);
  if (!surface) return std::unexpected(surface.error());
  if (const auto may = trusted(*path, options.force); !may) return may;
  const auto facts = facts_beside(*path);
  if (!facts) return std::unexpected(facts.error());
  const auto write = [&](const fs::path& file, auto&& text_of) -> std::expected<void, Failure> {
    if (file.empty()) return {};
    const auto text = text_of(*surface, *facts, file.filename().string());
    if (!text) return error(fmt::format("{}: cannot be exported as {}", path->string(), text.error().what));
    const Existing existing = options.force ? Existing::replaced : Existing::kept;
    if (auto written = write_file(file, *text, existing); !written) return written;
    const std::string line = fmt::format("{}: {} x {} control points, mm\n", hal::printable(file.string()),
                                         surface->control_u(), surface->control_v());
    is_standard_output(file) ? say(line) : show(line);
    return {};
  };
  if (auto step = write(options.step, step_file); !step) return step;
  return write(options.iges, iges_file);
}

}  // namespace

int export_run(const ExportOptions& options) {
  const auto done = exported(options);
  if (done) return exit_done;
  return complain(done.error().what);
}

}  // namespace moldloft::firmware_like
