#include "firmware_like/run/run_folder.hpp"

#include "firmware_like/config/config.hpp"
#include "firmware_like/config/device_makes.hpp"
#include "firmware_like/config/plate_name.hpp"
#include "firmware_like/process/build_info.hpp"
#include "firmware_like/process/json_file.hpp"
#include "firmware_like/process/wall_time.hpp"
#include "firmware_like/run/flight_files.hpp"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <cerrno>
#include <ctime>
#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

namespace moldloft::firmware_like {
namespace {

namespace fs = std::filesystem;

std::unexpected<Failure> error(std::string what) { return std::unexpected{Failure{std::move(what)}}; }

fs::path store_path(const fs::path& folder) { return folder / "run.db"; }

std::string kind_name(RunKind kind) { return kind == RunKind::simulated ? "simulated" : "measured"; }

constexpr const char* results_of_a_run[] = {
    "summary.json", "surface.json", "surface.step", "surface.igs",    "boundary.ply",   "points.ply",
    "track.json",   "events.jsonl", "overview.svg", "timing.json",    "report.html",    "inspection.json",
    "design.json",  "frames.txt",   "frames.html",  "deviations.csv", "deviations.ply", "watchdog.json"};

void remove_store(const fs::path& folder) {
  std::error_code failed;
  for (const char* file : {"run.db", "run.db-wal", "run.db-shm"}) fs::remove(folder / file, failed);
}

std::expected<void, Failure> remove_simulated(const fs::path& folder) {
  const auto store = hal::RunStore::open(store_path(folder), hal::RunStore::Mode::read);
  const auto kind = store ? store->meta("kind") : std::expected<std::string, hal::StoreError>{""};
  if (!kind || *kind != kind_name(RunKind::simulated)) {
    return error(fmt::format("{}: holds a run already; give another --out", folder.string()));
  }
  remove_store(folder);
  // A new run that does not come so far must not stand beside what the old one found.
  std::error_code failed;
  for (const char* file : results_of_a_run) fs::remove(folder / file, failed);
  return {};
}

// out/run-YYYYmmdd-HHMMSS, made by us and by nobody else: two runs of one second get two.
std::expected<fs::path, Failure> make_new_folder() {
  std::error_code failed;
  const std::time_t now = std::time(nullptr);
  std::tm local{};
  ::localtime_r(&now, &local);
  const fs::path first = fs::path{"out"} / fmt::format("run-{:%Y%m%d-%H%M%S}", local);
  fs::create_directories(first.parent_path(), failed);
  constexpr int most_of_a_second = 1000;
  fs::path path = first;
  for (int n = 2; !failed && n <= most_of_a_second; ++n) {
    if (fs::create_directory(path, failed)) return path;
    path = first.string() + fmt::format("-{}", n);
  }
  return error(fmt::format("{}: cannot be created ({}); give another place with --out", path.string(),
                           failed.message()));
}

}  // namespace

std::expected<FolderClaim, Failure> FolderClaim::take(const fs::path& path) {
  auto claim = hal::claim_folder(path.string());
  if (!claim) return error(claim.error());
  FolderClaim taken;
  taken.claim_ = std::move(*claim);
  taken.folder_ = ::open(path.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  // A file system without such locks is no reason not to measure.
  if (taken.folder_ >= 0 && ::flock(taken.folder_, LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK)
    return error(fmt::format("{} is in use by another program (process {}): wait for its end, or stop it",
                             path.string(), hal::process_with_lock(taken.folder_)));
  return taken;
}

FolderClaim::~FolderClaim() {
  if (folder_ >= 0) ::close(folder_);
}

std::string begun_of(const RunFolder& run) { return run.store->meta("begun").value_or(""); }

bool holds_run(const fs::path& path) {
  std::error_code failed;
  return fs::exists(store_path(path), failed);
}

bool holds_results(const fs::path& path) {
  std::error_code failed;
  return fs::exists(path / "summary.json", failed) || fs::exists(path / "surface.json", failed);
}

// summary.json is written last: where it says complete, everything else is there too.
bool holds_complete_run(const fs::path& path) {
  std::error_code failed;
  if (!holds_run(path) || !fs::exists(path / "summary.json", failed)) return false;
  const auto summary = read_json(path / "summary.json");
  if (!summary || !summary->is_object()) return false;
  const Json result = summary->value("result", Json{});
  return result == "complete" || result == "warned";
}

std::expected<RunFolder, Failure> create_run(const fs::path& asked, const std::string& config_text,
                                             const hal::FrameCodec& codec, RunKind kind,
                                             const RunNames& names) {
  std::error_code failed;
  fs::path path = asked;
  bool made_folder = true;
  if (asked.empty()) {
    auto made = make_new_folder();
    if (!made) return std::unexpected{made.error()};
    path = std::move(*made);
  } else {
    made_folder = fs::create_directories(path, failed);
  }
  if (failed)
    return error(
        fmt::format("{}: cannot be created ({}); give another --out", path.string(), failed.message()));
  auto claim = FolderClaim::take(path);
  if (!claim) return std::unexpected{claim.error()};
  if (!holds_run(path) && holds_results(path)) {
    return error(fmt::format("{}: holds results whose run is not there; give another --out", path.string()));
  }
  if (holds_run(path)) {
    if (kind != RunKind::simulated) {
      return error(fmt::format("{}: holds a run already; give another --out, or --resume to go on with it",
                               path.string()));
    }
    if (auto removed = remove_simulated(path); !removed) return std::unexpected{removed.error()};
  }
  auto store = hal::RunStore::open(store_path(path), hal::RunStore::Mode::create);
  if (!store) {
    if (made_folder) fs::remove(path, failed);
    return error(store.error().what);
  }
  std::vector<std::pair<std::string, std::string>> about = {{"kind", kind_name(kind)},
                                                            {"config", config_text},
                                                            {"version", std::string{build_info().version}},
                                                            {"commit", std::string{build_info().commit}},
                                                            {"build", std::string{build_info().build}}};
  const RunNames kept{names.plate.empty() ? name_of_folder(path) : names.plate, names.remark};
  about.emplace_back("plate", kept.plate);
  if (!kept.remark.empty()) about.emplace_back("remark", kept.remark);
  about.emplace_back(frame_codec_key, codec.name);
  // A simulated run happens at no time: its seed brings it back, byte for byte.
  if (kind == RunKind::measured) about.emplace_back("begun", now_utc());
  for (const auto& [key, value] : about) {
    if (auto written = store->set_meta(key, value); !written) return error(written.error().what);
  }
  return RunFolder{path,    std::move(*claim), std::make_unique<hal::RunStore>(std::move(*store)),
                   nullptr, made_folder,       kept};
}

void discard_run(RunFolder run) {
  run.store.reset();  // closes the file
  remove_store(run.path);
  std::error_code not_empty;
  for (const auto& dump : flight_dumps(run.path)) fs::remove(dump, not_empty);
  if (run.made_folder) fs::remove(run.path, not_empty);
}

std::expected<bool, Failure> bring_back(const RunFolder& run) {
  if (holds_run(run.path)) return false;
  std::error_code failed;
  fs::create_directories(run.path, failed);
  if (failed) {
    return error(fmt::format("{}: was removed during the run and cannot be made again ({})",
                             run.path.string(), failed.message()));
  }
  remove_store(run.path);  // a log that is left alone would be taken for the new file's
  if (auto saved = run.store->save_copy(store_path(run.path)); !saved) return error(saved.error().what);
  return true;
}

std::expected<RunFolder, Failure> resume_run(const fs::path& path, const std::string& config_text,
                                             const RunNames& names) {
  std::expected<FolderClaim, Failure> claim;
  if (holds_run(path)) claim = FolderClaim::take(path);
  if (!claim) return std::unexpected{claim.error()};
  auto opened = open_run(path);
  if (!opened) return opened;
  opened->claim = std::move(*claim);
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

std::expected<RunFolder, Failure> open_run(const fs::path& path) {
  if (!holds_run(path)) {
    return error(fmt::format("{}: no run.db there; give the folder of a run", path.string()));
  }
  auto store = hal::RunStore::open(store_path(path), hal::RunStore::Mode::read);
  if (!store) return error(store.error().what);
  const auto codec = frame_codec_of(*store);
  if (!codec) return std::unexpected{codec.error()};
  auto shots = StoredShots::load(*store, **codec);
  if (!shots) return error(shots.error().what);
  RunNames names{store->meta("plate").value_or(name_of_folder(path)), store->meta("remark").value_or("")};
  return RunFolder{path,
                   {},
                   std::make_unique<hal::RunStore>(std::move(*store)),
                   std::make_unique<StoredShots>(std::move(*shots)),
                   false,
                   std::move(names)};
}

}  // namespace moldloft::firmware_like
