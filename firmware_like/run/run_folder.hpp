// The folder of one run: created before anything moves, so that a full or read-only disk shows at once.
//
// Blocking     yes; set-up time only
// Failure      one line: what, where, what to do. A folder that holds a run is never overwritten, only resumed
//              (simulated runs, which a seed brings back, may be replaced by simulated runs)
#pragma once

#include "firmware_like/process/failure.hpp"
#include "firmware_like/run/shot_files.hpp"
#include "hal/links/claim.hpp"
#include "hal/record/run_store.hpp"
#include "hal/scanner/frame_codec.hpp"

#include <expected>
#include <filesystem>
#include <memory>
#include <string>
#include <utility>

namespace moldloft::firmware_like {

// What people call this run's plate, and what they say of it (plate_name.hpp).
struct RunNames {
  std::string plate, remark;  // empty: not given
};

// One process writes to a run's folder, on this machine and in containers that share it. Reading is free: the store
// shows a reader what has been committed, while a run goes on too.
class FolderClaim {
 public:
  FolderClaim() = default;
  static std::expected<FolderClaim, Failure> take(const std::filesystem::path&);
  FolderClaim(FolderClaim&& other) noexcept
      : claim_{std::move(other.claim_)}, folder_{std::exchange(other.folder_, -1)} {}
  FolderClaim& operator=(FolderClaim&& other) noexcept {
    std::swap(claim_, other.claim_);
    std::swap(folder_, other.folder_);
    return *this;
  }
  ~FolderClaim();

 private:
  hal::Claim claim_;
  int folder_ = -1;
};

struct RunFolder {
  std::filesystem::path path;
  FolderClaim claim;  // while it is written to; none when it is only read
  std::unique_ptr<hal::RunStore> store;
  std::unique_ptr<StoredShots> archive;  // resumed: the shots that are there already
  bool made_folder = false;              // it was not there before
  RunNames names = {};  // as the store holds them; a plate that has no name there has the folder's
};

enum class RunKind { measured, simulated };

// An empty path stands for a new folder under out/, named by the time.
// The store keeps the codec's name; who reads the run's frames later finds the codec by it.
std::expected<RunFolder, Failure> create_run(const std::filesystem::path&, const std::string& config_text,
                                             const hal::FrameCodec&, RunKind, const RunNames& = {});
// Goes on under the name that the run has: another one is refused. A remark is added to the one that is there.
std::expected<RunFolder, Failure> resume_run(const std::filesystem::path&, const std::string& config_text,
                                             const RunNames& = {});
std::expected<RunFolder, Failure> open_run(const std::filesystem::path&);  // to read only

// Makes the run's folder and its store again when somebody has removed them; the open store still holds the
// data. Returns whether that was needed.
std::expected<bool, Failure> bring_back(const RunFolder&);

// Removes a run that was refused before anything was measured, so that it does not block the next try. It
// removes the store, and the folder too if it was made for the run and holds nothing else.
void discard_run(RunFolder);

// When the run began, UTC; empty where its store does not know.
std::string begun_of(const RunFolder&);

bool holds_run(const std::filesystem::path&);
bool holds_complete_run(const std::filesystem::path&);  // measured, and its results are written
bool holds_results(const std::filesystem::path&);       // of a run, or of a fit

}  // namespace moldloft::firmware_like
