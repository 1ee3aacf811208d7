#include "firmware_like/run_folder.hpp"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <ctime>

#include "firmware_like/build_info.hpp"
#include "firmware_like/config.hpp"
#include "firmware_like/flight_files.hpp"
#include "firmware_like/plate_name.hpp"

namespace moldloft::firmware_like {
namespace {

namespace fs = std::filesystem;

std::unexpected<RunError> error(std::string what) { return std::unexpected{RunError{std::move(what)}}; }

fs::path store_path(const fs::path& folder) { return folder / "run.db"; }

std::string kind_name(RunKind kind) { return kind == RunKind::simulated ? "simulated" : "measured"; }

void remove_store(const fs::path& folder) {
  std::error_code failed;
  for (const char* file : {"run.db", "run.db-wal", "run.db-shm"}) fs::remove(folder / file, failed);
}

std::expected<void, RunError> remove_simulated(const fs::path& folder) {
  const auto store = hal::RunStore::open(store_path(folder), hal::RunStore::Mode::read);
  const auto kind = store ? store->meta("kind") : std::expected<std::string, hal::StoreError>{""};
  if (!kind || *kind != kind_name(RunKind::simulated)) {
    return error(fmt::format("{}: holds a run already; give another --out", folder.string()));
  }
  remove_store(folder);
  return {};
}

}  // namespace

std::string now_utc() {
  const std::time_t now = std::time(nullptr);
  return fmt::format("{:%Y-%m-%dT%H:%M:%SZ}", *std::gmtime(&now));
}

bool holds_run(const fs::path& path) { return fs::exists(store_path(path)); }

std::expected<RunFolder, RunError> create_run(const fs::path& path, const std::string& config_text,
                                              RunKind kind, const RunNames& names) {
  std::error_code failed;
  const bool made_folder = fs::create_directories(path, failed);
  if (failed)
    return error(
        fmt::format("{}: cannot be created ({}); give another --out", path.string(), failed.message()));
  if (fs::exists(store_path(path))) {
    if (kind != RunKind::simulated) {
      return error(fmt::format("{}: holds a run already; give another --out, or --resume to go on with it",
                               path.string()));
    }
    if (auto removed = remove_simulated(path); !removed) return std::unexpected{removed.error()};
  }
  auto store = hal::RunStore::open(store_path(path), hal::RunStore::Mode::create);
  if (!store) return error(store.error().what);
  std::vector<std::pair<std::string, std::string>> about = {{"kind", kind_name(kind)},
                                                            {"config", config_text},
                                                            {"version", std::string{build_info().version}},
                                                            {"commit", std::string{build_info().commit}},
                                                            {"build", std::string{build_info().build}}};
  const RunNames kept{names.plate.empty() ? name_of_folder(path) : names.plate, names.remark};
  about.emplace_back("plate", kept.plate);
  if (!kept.remark.empty()) about.emplace_back("remark", kept.remark);
  // A simulated run happens at no time: its seed brings it back, byte for byte.
  if (kind == RunKind::measured) about.emplace_back("begun", now_utc());
  for (const auto& [key, value] : about) {
    if (auto written = store->set_meta(key, value); !written) return error(written.error().what);
  }
  return RunFolder{path, std::make_unique<hal::RunStore>(std::move(*store)), nullptr, made_folder, kept};
}

void discard_run(RunFolder run) {
  run.store.reset();  // closes the file
  remove_store(run.path);
  std::error_code not_empty;
  for (const auto& dump : flight_dumps(run.path)) fs::remove(dump, not_empty);
  if (run.made_folder) fs::remove(run.path, not_empty);
}

std::expected<RunFolder, RunError> resume_run(const fs::path& path, const std::string& config_text,
                                              const RunNames& names) {
  auto opened = open_run(path);
  if (!opened) return opened;
  const auto config = opened->store->meta("config");
  if (!config) return error(config.error().what);
  // The stored shots lead to the same places only if everything that places are computed from is as it was.
  if (const std::string key = first_difference(*config, config_text); !key.empty()) {
    return error(
        fmt::format("{}: was begun with another configuration ('{}' differs); resume it with the same, or "
                    "begin a new run with "
                    "another --out",
                    path.string(), key));
  }
  auto& kept = opened->names;
  if (!names.plate.empty() && names.plate != kept.plate) {
    return error(fmt::format(
        "{}: is the run of plate '{}', not of '{}'; resume it without --plate, or begin a new run "
        "with another --out",
        path.string(), kept.plate, names.plate));
  }
  if (!names.remark.empty() && kept.remark.find(names.remark) == kept.remark.npos) {
    auto both = one_line(kept.remark.empty() ? names.remark : kept.remark + "; " + names.remark,
                         "--remark, with the one that the run has", longest_remark);
    if (!both) return error(both.error());
    kept.remark = std::move(*both);
  }
  auto store = hal::RunStore::open(store_path(path), hal::RunStore::Mode::append);
  if (!store) return error(store.error().what);
  // A store of before plates had names is called by its folder from now on.
  for (const auto& [key, value] : {std::pair{"plate", kept.plate}, std::pair{"remark", kept.remark},
                                   std::pair{"resumed_with", version_text()}}) {
    if (value.empty()) continue;
    if (auto written = store->set_meta(key, value); !written) return error(written.error().what);
  }
  // What is fitted from this run later has to have room for all of it.
  if (auto written = store->set_meta("config", config_text); !written) return error(written.error().what);
  opened->store = std::make_unique<hal::RunStore>(std::move(*store));
  return opened;
}

std::expected<RunFolder, RunError> open_run(const fs::path& path) {
  if (!fs::exists(store_path(path))) {
    return error(fmt::format("{}: no run.db there; give the folder of a run", path.string()));
  }
  auto store = hal::RunStore::open(store_path(path), hal::RunStore::Mode::read);
  if (!store) return error(store.error().what);
  auto shots = StoredShots::load(*store);
  if (!shots) return error(shots.error().what);
  RunNames names{store->meta("plate").value_or(name_of_folder(path)), store->meta("remark").value_or("")};
  return RunFolder{path, std::make_unique<hal::RunStore>(std::move(*store)),
                   std::make_unique<StoredShots>(std::move(*shots)), false, std::move(names)};
}

fs::path default_run_path() {
  const std::time_t now = std::time(nullptr);
  return fs::path{"out"} / fmt::format("run-{:%Y%m%d-%H%M%S}", *std::localtime(&now));
}

}  // namespace moldloft::firmware_like
