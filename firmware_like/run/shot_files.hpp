// The shots of a run store, in memory, as an archive for the cell: what --resume and `moldloft fit` go
// through first. Memory: 650 kB a shot of 50,000 points; loaded before the first tick.
#pragma once

#include "hal/record/run_store.hpp"
#include "tasks/cell/shot_archive.hpp"

#include <map>

namespace moldloft::firmware_like {

class StoredShots final : public tasks::ShotArchive {
 public:
  static std::expected<StoredShots, hal::StoreError> load(const hal::RunStore&, const hal::FrameCodec&);
  const tasks::ArchivedShot* find(std::uint32_t number) const override;
  std::uint32_t last() const override { return last_; }
  std::uint32_t last_epoch() const { return last_epoch_; }  // 0 for none
  std::size_t size() const { return shots_.size(); }

 private:
  std::vector<std::unique_ptr<hal::Frame>> frames_;
  std::map<std::uint32_t, tasks::ArchivedShot> shots_;
  std::uint32_t last_ = 0, last_epoch_ = 0;
};

}  // namespace moldloft::firmware_like
