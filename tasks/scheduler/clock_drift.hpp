// How fast a device's clock runs against ours: the least-squares line through pairs of readings, in constant memory.
//
// Thread       the control thread
// Allocation   none
// Cost         a dozen multiply-adds a pair
// Failure      fewer than three pairs, or no time between them: no estimate
#pragma once

#include "hal/base/clock.hpp"
#include "hal/base/realtime.hpp"

#include <cstdint>
#include <optional>

namespace moldloft::tasks {

struct ClockDriftEstimate {
  double ppm = 0;        // positive: the device's clock is fast
  double sigma_ppm = 0;  // standard deviation of that, from the scatter about the line
  double scatter_us = 0;
  std::uint64_t pairs = 0;
};

class ClockDrift {
 public:
  // `ours` and `theirs` belong to one event, as exactly as its report allows; in order of time. A device that has
  // restarted counts anew: reset() then.
  void add(hal::Instant ours, std::uint64_t theirs_ns) noexcept MOLDLOFT_NONBLOCKING;
  void reset() noexcept MOLDLOFT_NONBLOCKING { *this = ClockDrift{}; }
  std::optional<ClockDriftEstimate> estimate() const noexcept;

 private:
  // Relative to the first pair, in seconds; theirs less ours in microseconds. So the squares lose no digit of
  // a day's nanoseconds.
  hal::Instant first_ours_{0};
  std::uint64_t first_theirs_ = 0, pairs_ = 0;
  double sum_t_ = 0, sum_d_ = 0, sum_tt_ = 0, sum_td_ = 0, sum_dd_ = 0;
};

}  // namespace moldloft::tasks
