// Shots that have been taken before. A run that is resumed or fitted again gets them from here instead of
// from the devices, in their original order. It goes through the same states as if they had just arrived.
//
// Thread       the control thread; find() must not block or allocate (the shots are in memory before the run starts)
#pragma once

#include "hal/base/realtime.hpp"
#include "hal/record/run_record.hpp"
#include "hal/scanner/frame.hpp"

#include <cstdint>

namespace moldloft::tasks {

struct ArchivedShot {
  const hal::Frame* frame = nullptr;
  hal::ShotRecord record;
};

class ShotArchive {
 public:
  virtual ~ShotArchive() = default;
  // The shot with this number in the run, counted from 1; nothing when it was not taken.
  virtual const ArchivedShot* find(std::uint32_t number) const MOLDLOFT_NONBLOCKING = 0;
  // The highest number that was taken, 0 for none. A number below it that is not there was given up at the time.
  virtual std::uint32_t last() const MOLDLOFT_NONBLOCKING = 0;
};

// A shot id on the wire carries the shot's number in the run in its low bits, and the run's epoch above. So
// two runs, or one run before and after a restart, never ask the scanner for the same id. An old stored frame
// is never taken for new.
constexpr std::uint32_t shot_number_bits = 12;
constexpr std::uint32_t max_shot_number = (1u << shot_number_bits) - 1;
constexpr std::uint32_t shot_number_of(std::uint32_t shot_id) { return shot_id & max_shot_number; }

}  // namespace moldloft::tasks
