// The fixed-step cooperative scheduler: a static table of tasks, run in its order at every tick, and
// background tasks in the slack that is left.
//
// Deadlines    absolute: next = previous + tick, in 64-bit nanoseconds. A tick that another ran into by
//              more than the tolerance is missed. It is counted with its cause and treated by the policy
//              of the settings
// Statistics   one clock read per task boundary; the first ticks after start() are left out (caches and pages
//              warm up). Costs are by the clock. The thread's own processor time is read once between two
//              ticks, and again where a tick was missed. It tells a long task from a preempted one
// Background   a step runs only if it fits between now and the guard time before the next tick. Its time is
//              taken as the larger of its declared quantum and its decaying measured peak. Where the pieces
//              of a kind cost alike (next_kind()), the kind's measured peak decides, if the quantum would
//              still end within the tolerance of a late tick. A step that does not fit has its peak halved
//              towards the quantum. After `starvation_ticks` without a run a task gets one step, counted as
//              forced, as soon as its quantum ends within the guard time or that tolerance. All tasks
//              together get at most one forced step a tick. So background work that keeps its quantum delays
//              a tick by no more than that, and never costs one. A table that keeps its budgets leaves room
//              in every tick (task_table.hpp)
// Thread       add*() before start(); run*() on the control thread; running_task() and heartbeat() from anywhere
// Blocking     only in Clock::sleep_until, between ticks
// Allocation   none: the tables are arrays of fixed size
// Cost         60 ns a task that is due, 2 ns one that is not (moldloft-bench scheduler)
// Failure      add*() asserts on what check_table() (task.hpp) refuses: a table is known when the program is written
#pragma once

#include "hal/base/realtime.hpp"
#include "hal/record/flight_recorder.hpp"
#include "tasks/scheduler/task_record.hpp"

#include <array>
#include <atomic>
#include <cstdint>
#include <span>
#include <string_view>

namespace moldloft::tasks {

enum class MissedTickPolicy : std::uint8_t {
  skip_keep_phase,  // missed ticks are dropped, the next one comes where it would have come
  catch_up_once,    // the last missed tick is done at once, the others are dropped, the phase is kept
  reanchor,         // the schedule starts anew from now
  stop,             // the run ends: for cells where a late command is worse than none
};

struct SchedulerSettings {
  Duration tick = 1ms;
  // Kept free before the next tick: a background step may overrun by this without harm.
  Duration guard = 100us;
  Duration late_tolerance = 100us;  // a tick that can still begin within this is late, not missed
  MissedTickPolicy missed = MissedTickPolicy::skip_keep_phase;
  std::uint32_t warm_up_ticks = 10;
  std::uint32_t starvation_ticks = 100;
};

class Scheduler {
 public:
  static constexpr int no_task = -1;
  static constexpr int background_base = 100;  // running_task() of background task i is background_base + i
  static constexpr std::size_t misses_kept = 16;

  // `flight`, when given, is told of every tick, task and missed tick.
  Scheduler(Clock& clock, const SchedulerSettings& settings, hal::FlightRecorder* flight = nullptr)
      : clock_{clock}, settings_{settings}, flight_{flight} {}

  int add(const TaskSpec& spec, Task& task);
  int add_background(const BackgroundSpec& spec, BackgroundTask& task);

  void
  start();  // the first tick is due at the clock's good_start(); once more after a pause, which counts for nothing
  bool run_tick();  // waits for the next tick and does it; false when the policy `stop` has ended the run
  void run_until(Instant end);

  // ---- from anywhere
  int running_task() const noexcept { return running_.load(std::memory_order_relaxed); }
  std::uint64_t heartbeat() const noexcept {
    return heartbeat_.load(std::memory_order_relaxed);
  }                                                               // ticks done
  std::string_view name_of(int task) const MOLDLOFT_NONBLOCKING;  // a constant after the last add*()

  // ---- on the control thread, or when it has come to rest
  std::uint64_t ticks() const noexcept { return ticks_; }
  std::uint64_t missed_ticks() const noexcept { return missed_; }
  std::uint32_t misses_in_a_row() const noexcept { return misses_in_a_row_; }
  std::uint64_t missed_by(MissCause cause) const noexcept {
    return missed_by_[static_cast<std::size_t>(cause)];
  }
  const MissedTick& last_miss() const noexcept { return last_miss_; }
  // The first `misses_kept` times that ticks were missed. The first losses tell more than their consequences.
  std::span<const MissedTick> first_misses() const noexcept { return {first_misses_.data(), first_count_}; }
  Instant next_tick() const noexcept { return next_tick_; }

  std::span<const TaskRecord> tasks() const { return {records_.data(), task_count_}; }
  std::span<const BackgroundRecord> background() const {
    return {background_records_.data(), background_count_};
  }
  const Histogram& wake_up() const { return wake_up_; }       // how late a tick began
  Instant latest_wake_up() const { return latest_wake_up_; }  // when the latest of them came
  const Histogram& execution() const { return execution_; }   // what the whole table took
  const Histogram& slack() const { return slack_; }           // left over when the table was done
  // By how much the background work of a tick moved the next one; 0 where it did not.
  const Histogram& pushed() const { return pushed_; }
  const SchedulerSettings& settings() const { return settings_; }

 private:
  void run_table(Instant tick_start, Instant& t) MOLDLOFT_NONBLOCKING;
  void count_run(std::size_t i, Instant began, Duration cost, Instant allowed_start) MOLDLOFT_NONBLOCKING;
  void run_background(Instant& t, Instant limit) MOLDLOFT_NONBLOCKING;
  bool step_background(std::size_t i, Instant& t, Instant limit, bool& may_force) MOLDLOFT_NONBLOCKING;
  bool step_fits(std::size_t i, std::size_t kind, Instant t, Instant limit) const MOLDLOFT_NONBLOCKING;
  void follow_peak(std::size_t i, std::size_t kind, Duration cost) MOLDLOFT_NONBLOCKING;
  bool count_missed(Instant t) MOLDLOFT_NONBLOCKING;
  void keep_miss(Instant t, std::uint64_t lost) MOLDLOFT_NONBLOCKING;
  void count_slips(std::uint64_t lost) MOLDLOFT_NONBLOCKING;
  bool warm() const noexcept { return ticks_ > started_after_ + settings_.warm_up_ticks; }

  Clock& clock_;
  SchedulerSettings settings_;
  hal::FlightRecorder* flight_;
  std::array<Task*, max_tasks> tasks_{};
  std::array<TaskRecord, max_tasks> records_{};
  std::array<BackgroundTask*, max_background> background_{};
  std::array<BackgroundRecord, max_background> background_records_{};
  std::array<std::array<Duration, step_kinds>, max_background> peak_{};
  std::array<std::uint64_t, max_background> last_run_tick_{};
  std::size_t task_count_ = 0, background_count_ = 0, next_background_ = 0;
  Instant next_tick_{0}, woken_{0}, latest_wake_up_{0};
  Duration spent_before_{0};  // the thread's processor time when it went to sleep
  std::uint64_t number_ = 0;  // of the next tick, missed ones included: decides which tasks are due
  std::uint64_t ticks_ = 0, missed_ = 0, started_after_ = 0;
  std::uint32_t misses_in_a_row_ = 0;
  int longest_task_ = no_task;
  Duration longest_cost_{0};
  std::array<MissedTick, misses_kept> first_misses_{};
  MissedTick last_miss_;
  std::size_t first_count_ = 0;
  std::array<std::uint64_t, miss_causes> missed_by_{};
  std::atomic<int> running_{no_task};
  std::atomic<std::uint64_t> heartbeat_{0};
  Histogram wake_up_, execution_, slack_, pushed_;
};

}  // namespace moldloft::tasks
