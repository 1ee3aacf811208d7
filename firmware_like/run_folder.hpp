// The folder of one run: created before anything moves, so that a full or read-only disk shows at once.
//
// Blocking     yes; set-up time only
// Failure      one line: what, where, what to do. A folder that holds a run is never overwritten, only resumed
//              (simulated runs, which a seed brings back, may be replaced by simulated runs)
#pragma once

#include <expected>
#include <filesystem>
#include <memory>
#include <string>

#include "firmware_like/shot_files.hpp"
#include "hal/run_store.hpp"

namespace moldloft::firmware_like {

struct RunError {
  std::string what;
};

// What people call this run's plate, and what they say of it (plate_name.hpp).
struct RunNames {
  std::string plate, remark;  // empty: not given
};

struct RunFolder {
  std::filesystem::path path;
  std::unique_ptr<hal::RunStore> store;
  std::unique_ptr<StoredShots> archive;  // resumed: the shots that are there already
  bool made_folder = false;              // it was not there before
  RunNames names = {};  // as the store holds them; a plate that has no name there has the folder's
};

enum class RunKind { measured, simulated };

std::expected<RunFolder, RunError> create_run(const std::filesystem::path&, const std::string& config_text,
                                              RunKind, const RunNames& = {});
// Goes on under the name that the run has: another one is refused. A remark is added to the one that is there.
std::expected<RunFolder, RunError> resume_run(const std::filesystem::path&, const std::string& config_text,
                                              const RunNames& = {});
std::expected<RunFolder, RunError> open_run(const std::filesystem::path&);  // to read only

// Takes a run away that was refused before anything was measured, so that it does not block the next try: its
// store, and the folder if it was made for it and holds nothing else.
void discard_run(RunFolder);

bool holds_run(const std::filesystem::path&);
std::string now_utc();                     // "2026-01-31T12:00:00Z"
std::filesystem::path default_run_path();  // out/run-YYYYmmdd-HHMMSS

}  // namespace moldloft::firmware_like
