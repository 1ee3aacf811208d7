#include "firmware_like/run/shot_files.hpp"

#include <algorithm>

namespace moldloft::firmware_like {

std::expected<StoredShots, hal::StoreError> StoredShots::load(const hal::RunStore& store,
                                                              const hal::FrameCodec& codec) {
  const auto records = store.shots();
  if (!records) return std::unexpected{records.error()};
  StoredShots loaded;
  for (const auto& record : *records) {
    auto frame = store.frame(record, codec);
    if (!frame) return std::unexpected{frame.error()};
    loaded.frames_.push_back(std::make_unique<hal::Frame>(std::move(*frame)));
    loaded.last_epoch_ = std::max(loaded.last_epoch_, record.shot_id >> tasks::shot_number_bits);
    loaded.last_ = std::max(loaded.last_, tasks::shot_number_of(record.shot_id));
    loaded.shots_[tasks::shot_number_of(record.shot_id)] = {loaded.frames_.back().get(), record};
  }
  return loaded;
}

const tasks::ArchivedShot* StoredShots::find(std::uint32_t number) const {
  const auto found = shots_.find(number);
  return found == shots_.end() ? nullptr : &found->second;
}

}  // namespace moldloft::firmware_like
