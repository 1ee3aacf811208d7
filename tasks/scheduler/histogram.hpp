// A log-linear histogram of durations in constant memory: 64 buckets an octave, so a percentile is at most
// 1.6 % above the true one. Values beyond 2^36 ns (68 s) go to an overflow bucket of their own, never into
// a wrong one.
//
// Thread       one writer; readers take a copy after the writer has stopped, or accept a count that is one behind
// Allocation   none
// Cost         add() about 2 ns
#pragma once

#include "hal/base/realtime.hpp"

#include <array>
#include <chrono>
#include <cstdint>

namespace moldloft::tasks {

class Histogram {
 public:
  using Duration = std::chrono::nanoseconds;

  void add(Duration value) noexcept MOLDLOFT_NONBLOCKING;  // negative values count as zero
  void merge(const Histogram& other) noexcept;
  void reset() noexcept { *this = Histogram{}; }

  std::uint64_t count() const noexcept { return count_; }
  std::uint64_t overflows() const noexcept { return overflows_; }
  bool empty() const noexcept { return count_ == 0; }
  Duration min() const noexcept { return count_ == 0 ? Duration{0} : Duration{min_}; }
  Duration max() const noexcept { return Duration{max_}; }
  Duration mean() const noexcept;
  // The smallest bucket limit that at least `fraction` (0..1) of the values do not exceed; never beyond max().
  Duration percentile(double fraction) const noexcept;
  // From the buckets, each by its middle: as exact as they are. 0 below two values.
  Duration standard_deviation() const noexcept;

  // ---- the buckets, for a page that draws them: bucket i holds the values of lower_limit(i) to
  // upper_limit(i), both included
  static constexpr std::size_t size() noexcept { return buckets; }
  std::uint64_t in_bucket(std::size_t i) const noexcept { return counts_[i]; }
  static Duration lower_limit(std::size_t i) noexcept {
    return Duration{i == 0 ? 0 : static_cast<std::int64_t>(limit_of(i - 1)) + 1};
  }
  static Duration upper_limit(std::size_t i) noexcept {
    return Duration{static_cast<std::int64_t>(limit_of(i))};
  }

 private:
  static constexpr int sub_bits = 6;  // 64 buckets an octave: width at most 1/64 of the value
  static constexpr int octaves = 36 - sub_bits;
  static constexpr std::size_t buckets = static_cast<std::size_t>(octaves + 1) << sub_bits;
  static std::size_t bucket_of(std::uint64_t ns) noexcept;
  static std::uint64_t limit_of(std::size_t bucket) noexcept;  // the largest value that falls into it

  std::array<std::uint64_t, buckets> counts_{};  // 32 bits would be full after 50 days of milliseconds
  std::uint64_t count_ = 0, overflows_ = 0;
  std::int64_t min_ = INT64_MAX, max_ = 0;
  std::int64_t sum_ = 0;  // of nanoseconds: 292 years
};

}  // namespace moldloft::tasks
