// What the scheduler counts of every task, and what it keeps of a missed tick.
//
// Thread       written on the control thread; read when it has come to rest
// Allocation   none
#pragma once

#include "tasks/scheduler/histogram.hpp"
#include "tasks/scheduler/task.hpp"

#include <cstdint>

namespace moldloft::tasks {

struct TaskRecord {
  TaskSpec spec;
  std::uint64_t runs = 0;
  std::uint64_t slips = 0;        // runs that fell into missed ticks
  std::uint64_t late_starts = 0;  // started later than the budgets of the tasks before it allow
  std::uint64_t overruns = 0;     // took longer than its budget
  Duration lateness{0};           // of all late starts together, beyond what those budgets allow
  Histogram cost;                 // from its start to its end by the clock, preemption included
  Instant longest_at{0};          // when the longest run began
};

struct BackgroundRecord {
  BackgroundSpec spec;
  std::uint64_t runs = 0;
  std::uint64_t overruns = 0;  // took longer than its quantum
  std::uint64_t refused = 0;   // ticks in which it had work and did not fit into the slack
  std::uint64_t forced = 0;    // run all the same, so that it does not starve
  Histogram cost;
  Instant longest_at{0};  // when the longest step began
};

// The cause of a missed tick: the largest of the three parts that made it late.
enum class MissCause : std::uint8_t {
  woken_late,  // the machine woke the control thread late
  preempted,   // the control thread was ready and did not have the processor
  computing,   // a task, control or background, used the processor for too long
};
inline constexpr std::size_t miss_causes = 3;
constexpr std::string_view to_string(MissCause cause) {
  return cause == MissCause::woken_late  ? "woken late"
         : cause == MissCause::preempted ? "preempted"
                                         : "computing";
}

struct MissedTick {
  std::uint64_t tick = 0;  // number of the first tick that was lost
  Instant at{0};           // when the tick before it ended
  std::uint64_t lost = 0;  // ticks, one after the other
  MissCause cause{};
  int task = -1;      // the one that ran longest in the tick before; of woken_late: none
  Duration late{0};   // how much later than its due time the first lost tick could have begun
  Duration wall{0};   // what the tick before took from its wake-up on
  Duration spent{0};  // ... of that, on the processor
};

}  // namespace moldloft::tasks
