// The fixed-step cooperative scheduler: a static table of tasks, run in its order at every tick, and
// background tasks in the slack that is left.
//
// Deadlines    absolute: next = previous + tick, in 64-bit nanoseconds; a tick that another ran into by more
//              than the tolerance is missed, counted with its cause, and treated by the policy that the settings name
// Statistics   one clock read per task boundary; the first ticks after start() are left out (caches and pages warm up)
// Background   a step runs only if the larger of its declared quantum and its decaying measured peak fits between now
//              and the guard time before the next tick. A task that does not fit has its peak halved towards the
//              declared quantum; after `starvation_ticks` without a run it gets one step all the same
//              (counted as forced)
// Thread       add*() before start(); run*() on the control thread; running_task() from anywhere
// Blocking     only in Clock::sleep_until, between ticks
// Allocation   none: the tables are arrays of fixed size
// Failure      add*() asserts on a full table: its size is known when the program is written
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <span>
#include <string_view>

#include "hal/clock.hpp"
#include "hal/realtime.hpp"
#include "tasks/histogram.hpp"

namespace moldloft::tasks {

using hal::Clock;
using hal::Duration;
using hal::Instant;
using namespace std::chrono_literals;

class Task {
 public:
  virtual ~Task() = default;
  virtual void run(Instant now) MOLDLOFT_NONBLOCKING = 0;  // `now`: the clock's reading at the task's start
};

// A task made of a callable: for the rows of the table that only call one function of a driver.
template <typename Function>
class FunctionTask final : public Task {
 public:
  explicit FunctionTask(Function function) : function_{function} {}
  void run(Instant now) MOLDLOFT_NONBLOCKING override { function_(now); }

 private:
  Function function_;
};

class BackgroundTask {
 public:
  virtual ~BackgroundTask() = default;
  virtual bool has_work() const MOLDLOFT_NONBLOCKING = 0;
  virtual void step(Instant deadline)
      MOLDLOFT_NONBLOCKING = 0;  // one bounded piece of work; returns well before the deadline
};

enum class Criticality { vital, ordinary };  // an overrun of a vital task counts towards the limit of misses

struct TaskSpec {
  std::string_view name;
  std::uint32_t period_ticks = 1;
  std::uint32_t offset_ticks = 0;
  Duration budget = 100us;
  Criticality criticality = Criticality::vital;
};

struct BackgroundSpec {
  std::string_view name;
  Duration quantum = 200us;
};

struct TaskRecord {
  TaskSpec spec;
  std::uint64_t runs = 0;
  std::uint64_t late_starts = 0;  // started later than the budgets of the tasks before it allow
  std::uint64_t overruns = 0;     // took longer than its budget
  Histogram cost;
};

struct BackgroundRecord {
  BackgroundSpec spec;
  std::uint64_t runs = 0;
  std::uint64_t overruns = 0;  // took longer than its quantum
  std::uint64_t refused = 0;   // did not fit into the slack
  std::uint64_t forced = 0;    // run all the same, so that it does not starve
  Histogram cost;
};

enum class MissedTickPolicy {
  skip_keep_phase,  // missed ticks are dropped, the next one comes where it would have come
  reanchor,         // the schedule starts anew from now
  stop,             // the run ends: for cells where a late command is worse than none
};

struct SchedulerSettings {
  Duration tick = 1ms;
  Duration guard =
      100us;  // kept free before the next tick: a background step may overrun by this without harm
  Duration late_tolerance = 100us;  // a tick that can still begin within this is late, not missed
  MissedTickPolicy missed = MissedTickPolicy::skip_keep_phase;
  std::uint32_t warm_up_ticks = 10;
  std::uint32_t starvation_ticks = 100;
};

class Scheduler {
 public:
  static constexpr std::size_t max_tasks = 16, max_background = 4;
  static constexpr int no_task = -1;
  static constexpr int background_base = 100;  // running_task() of background task i is background_base + i

  Scheduler(Clock& clock, const SchedulerSettings& settings) : clock_{clock}, settings_{settings} {}

  int add(const TaskSpec& spec, Task& task);
  int add_background(const BackgroundSpec& spec, BackgroundTask& task);

  void start();     // the first tick is due now
  bool run_tick();  // waits for the next tick and does it; false when the policy `stop` has ended the run
  void run_until(Instant end);

  std::uint64_t ticks() const noexcept { return ticks_; }
  std::uint64_t missed_ticks() const noexcept { return missed_; }
  std::uint32_t misses_in_a_row() const noexcept { return misses_in_a_row_; }
  int last_miss_cause() const noexcept {
    return last_miss_cause_;
  }  // the task that ran longest then; no_task: woken late
  int running_task() const noexcept { return running_.load(std::memory_order_relaxed); }
  std::string_view name_of(int task) const;

  std::span<const TaskRecord> tasks() const { return {records_.data(), task_count_}; }
  std::span<const BackgroundRecord> background() const {
    return {background_records_.data(), background_count_};
  }
  const Histogram& wake_up() const { return wake_up_; }  // how late a tick began
  const Histogram& slack() const { return slack_; }      // left over when the table was done
  const SchedulerSettings& settings() const { return settings_; }

 private:
  void run_table(Instant tick_start, Instant& t) MOLDLOFT_NONBLOCKING;
  void run_background(Instant& t, Instant limit) MOLDLOFT_NONBLOCKING;
  bool step_background(std::size_t i, Instant& t, Instant limit) MOLDLOFT_NONBLOCKING;
  bool count_missed(Instant t) MOLDLOFT_NONBLOCKING;
  bool warm() const noexcept { return ticks_ > settings_.warm_up_ticks; }

  Clock& clock_;
  SchedulerSettings settings_;
  std::array<Task*, max_tasks> tasks_{};
  std::array<TaskRecord, max_tasks> records_{};
  std::array<BackgroundTask*, max_background> background_{};
  std::array<BackgroundRecord, max_background> background_records_{};
  std::array<Duration, max_background> peak_{};
  std::array<std::uint64_t, max_background> last_run_tick_{};
  std::size_t task_count_ = 0, background_count_ = 0, next_background_ = 0;
  Instant next_tick_{0};
  std::uint64_t number_ = 0;  // of the next tick, missed ones included: decides which tasks are due
  std::uint64_t ticks_ = 0, missed_ = 0;
  std::uint32_t misses_in_a_row_ = 0;
  int longest_task_ = no_task, last_miss_cause_ = no_task;
  Duration longest_cost_{0};
  std::atomic<int> running_{no_task};
  Histogram wake_up_, slack_;
};

}  // namespace moldloft::tasks
