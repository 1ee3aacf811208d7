// What the operating system did to the calling thread: page faults, context switches, moves to another CPU.
//
//     ThreadCounter counter;        // from here
//     ...                           // at_tick() at each tick's start
//     const auto counts = counter.so_far();
//
// Cost         at_tick() a few nanoseconds (the CPU's number lies in memory that the kernel keeps up to date), the
//              rest two system calls of 0.3 us
// Blocking     no
// Allocation   none
// Failure      none
#pragma once

#include <cstdint>

namespace moldloft::firmware_like {

struct ThreadCounts {
  std::uint64_t ticks = 0;
  std::uint64_t minor_faults = 0;  // a page that was in memory, but not yet mapped
  std::uint64_t major_faults = 0;  // a page that had to be read from disk
  // A thread that only sleeps to its ticks gives its CPU away at most once a tick. More than `ticks` means
  // that it waited for something else.
  std::uint64_t voluntary_switches = 0;
  std::uint64_t involuntary_switches = 0;  // another thread took the CPU away
  std::uint64_t migrations = 0;            // ticks that began on another CPU than the one before
  std::uint64_t suspensions =
      0;  // of the promise: a link was closed or opened (hal/base/realtime_section.hpp)

  ThreadCounts& operator+=(const ThreadCounts&) noexcept;
};

class ThreadCounter {
 public:
  ThreadCounter() noexcept;
  void at_tick() noexcept;
  ThreadCounts so_far() const noexcept;

 private:
  ThreadCounts start_;
  std::uint64_t ticks_ = 0, migrations_ = 0;
  int cpu_;
};

}  // namespace moldloft::firmware_like
