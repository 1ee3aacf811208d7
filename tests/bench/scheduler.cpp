// moldloft-bench scheduler: what a tick costs beside its tasks, next to one read of the clock in the same run.
#include "tasks/scheduler/scheduler.hpp"

#include "bench/benchmark.hpp"
#include "bench/stopwatch.hpp"

#include <fmt/core.h>

#include <array>
#include <memory>
#include <vector>

namespace moldloft::bench {

namespace {

using namespace tasks;

// Reads real time and never sleeps: every tick comes early, so none is missed and nothing but the scheduler is at work.
class SleeplessClock final : public hal::Clock {
 public:
  Instant now() noexcept override { return clock_.now(); }
  void sleep_until(Instant) noexcept override {}
  Duration thread_time() noexcept override { return clock_.thread_time(); }

 private:
  hal::SteadyClock clock_;
};

class IdleTask final : public Task {
 public:
  void run(Instant) override { ++runs_; }

 private:
  std::uint64_t runs_ = 0;
};

struct Table {
  Table(std::size_t tasks, std::uint32_t period, bool with_flight)
      : scheduler{clock, {.tick = 1ms, .warm_up_ticks = 10}, with_flight ? &flight : nullptr} {
    for (std::size_t i = 0; i < tasks; ++i)
      scheduler.add({.name = "idle", .period_ticks = period, .offset_ticks = period - 1, .budget = 50us},
                    idle[i]);
    scheduler.start();
  }
  SleeplessClock clock;
  hal::FlightRecorder flight;
  std::array<IdleTask, max_tasks> idle;
  Scheduler scheduler;
};

// Nanoseconds of one run_tick(), the median of many stretches.
double tick_ns(std::size_t tasks, std::uint32_t period, bool with_flight, int ticks) {
  const auto table = std::make_unique<Table>(tasks, period, with_flight);
  const auto work = [&] {
    for (int i = 0; i < ticks; ++i) keep(table->scheduler.run_tick());
  };
  return 1e9 * time_of(21, work).median / ticks;
}

double clock_ns(int reads) {
  SleeplessClock clock;
  return 1e9 *
         time_of(21,
                 [&] {
                   for (int i = 0; i < reads; ++i) keep(clock.now());
                 })
             .median /
         reads;
}

double thread_time_ns(int reads) {
  SleeplessClock clock;
  return 1e9 *
         time_of(21,
                 [&] {
                   for (int i = 0; i < reads; ++i) keep(clock.thread_time());
                 })
             .median /
         reads;
}

double histogram_ns(int adds) {
  const auto histogram = std::make_unique<Histogram>();
  return 1e9 *
         time_of(21,
                 [&] {
                   for (int i = 0; i < adds; ++i) histogram->add(Duration{(i * 7919) & 0xFFFFF});
                   keep(*histogram);
                 })
             .median /
         adds;
}

}  // namespace

Json run_scheduler(const Options& options) {
  const int ticks = options.quick ? 2'000 : 50'000;
  const double clock = clock_ns(ticks * 4), thread_time = thread_time_ns(ticks),
               histogram = histogram_ns(ticks * 4);
  const double empty = tick_ns(0, 1, true, ticks);
  const double due = tick_ns(max_tasks, 1, true, ticks);
  const double due_without_flight = tick_ns(max_tasks, 1, false, ticks);
  const double not_due = tick_ns(max_tasks, 1u << 30, true, ticks);

  // On the way from the wake-up to the last command nothing but the table counts; the rest of a tick's own work comes
  // when the table is done.
  const auto table = std::make_unique<Table>(max_tasks, 1, true);
  for (int i = 0; i < ticks; ++i) keep(table->scheduler.run_tick());
  const double table_ns = static_cast<double>(table->scheduler.execution().percentile(0.5).count());

  Json result{{"clock_read_ns", clock},
              {"thread_time_ns", thread_time},
              {"histogram_add_ns", histogram},
              {"empty_tick_ns", empty},
              {"due_task_ns", (due - empty) / max_tasks},
              {"due_task_in_clock_reads", (due - empty) / max_tasks / clock},
              {"due_task_without_flight_recorder_ns", (due_without_flight - empty) / max_tasks},
              {"task_not_due_ns", (not_due - empty) / max_tasks},
              {"table_of_16_ns", table_ns},
              {"flight_recorder_note_ns", (due - due_without_flight) / (max_tasks + 1)}};
  if (options.quiet) return result;
  fmt::print("{:<58}{:>9}  {}\n", "what a tick costs beside its tasks", "ns", "asked");
  const auto row = [](std::string_view what, double ns, std::string_view asked) {
    fmt::print("{:<58}{:>9.1f}  {}\n", what, ns, asked);
  };
  row("one clock read", clock, "");
  row("one histogram value", histogram, "");
  row("a task that is due, statistics and flight recorder in", (due - empty) / max_tasks, "<= 100");
  row("... in clock reads", (due - empty) / max_tasks / clock, "");
  row("... without flight recorder", (due_without_flight - empty) / max_tasks, "");
  row("a task that is not due", (not_due - empty) / max_tasks, "<= 10");
  row("a table of 16 tasks, wake-up to end", table_ns, "<= 2000");
  row("an empty tick in all", empty, "");
  row("... of that, the thread's processor time (between ticks)", thread_time, "");
  return result;
}

}  // namespace moldloft::bench
