#include "tasks/scheduler/scheduler.hpp"

#include "tasks/scripted_clock.hpp"

#include <doctest/doctest.h>

using namespace moldloft::tasks;
using Instants = std::vector<Instant>;

namespace {
SchedulerSettings every_millisecond() { return {.tick = 1ms, .warm_up_ticks = 0}; }
}  // namespace

TEST_CASE("a tick that comes too late is skipped and the phase kept") {
  ScriptedClock clock;
  Scheduler scheduler{clock, every_millisecond()};
  ScriptedTask tracker{clock, {150us, 2300us, 150us}};
  scheduler.add({.name = "tracker", .period_ticks = 2, .budget = 200us}, tracker);

  scheduler.start();
  scheduler.run_until(7ms);

  CHECK(tracker.starts == Instants{0ms, 2ms, 6ms});  // due at 4 ms, but tick 4 came while it still ran
  CHECK(scheduler.tasks()[0].overruns == 1);
  CHECK(scheduler.missed_ticks() == 2);  // ticks 3 and 4
  CHECK(scheduler.name_of(scheduler.last_miss().task) == "tracker");
}

TEST_CASE("a tick that is late by less than the tolerance still runs") {
  ScriptedClock clock;
  Scheduler scheduler{clock, every_millisecond()};
  ScriptedTask task{clock, {1100us, 0us, 0us}};
  scheduler.add({.name = "task", .budget = 200us}, task);

  scheduler.start();
  scheduler.run_until(3ms);

  CHECK(task.starts == Instants{0us, 1100us, 2000us});
  CHECK(scheduler.missed_ticks() == 0);
}

TEST_CASE("one nanosecond beyond the tolerance is a missed tick") {
  ScriptedClock clock;
  Scheduler scheduler{clock, every_millisecond()};
  ScriptedTask task{clock, {1100us + 1ns}};
  scheduler.add({.name = "task", .budget = 200us}, task);
  scheduler.start();
  scheduler.run_until(3ms);
  CHECK(task.starts == Instants{0ms, 2ms});
  CHECK(scheduler.missed_ticks() == 1);
}

TEST_CASE("after one missed tick a task of period two still runs at even ticks") {
  ScriptedClock clock;
  Scheduler scheduler{clock, every_millisecond()};
  ScriptedTask task{clock, {150us, 1300us}};
  scheduler.add({.name = "task", .period_ticks = 2, .budget = 200us}, task);
  scheduler.start();
  scheduler.run_until(7ms);
  CHECK(task.starts == Instants{0ms, 2ms, 4ms, 6ms});  // tick 3 was missed
  CHECK(scheduler.missed_ticks() == 1);
}

TEST_CASE("re-anchoring begins the schedule anew where the late tick ended") {
  ScriptedClock clock;
  auto settings = every_millisecond();
  settings.missed = MissedTickPolicy::reanchor;
  Scheduler scheduler{clock, settings};
  ScriptedTask task{clock, {2300us}};
  scheduler.add({.name = "task", .budget = 200us}, task);
  scheduler.start();
  scheduler.run_until(4ms);
  CHECK(task.starts == Instants{0us, 2300us, 3300us});
}

TEST_CASE("the policy stop ends the run at the first missed tick") {
  ScriptedClock clock;
  auto settings = every_millisecond();
  settings.missed = MissedTickPolicy::stop;
  Scheduler scheduler{clock, settings};
  ScriptedTask task{clock, {0us, 5ms}};
  scheduler.add({.name = "task", .budget = 200us}, task);
  scheduler.start();
  CHECK(scheduler.run_tick());
  CHECK_FALSE(scheduler.run_tick());
  CHECK(scheduler.missed_ticks() == 4);  // due at 2, 3, 4 and 5 ms; at 6 ms the next could begin on the dot
}

TEST_CASE("tasks run in the order of the table, each at its period and offset") {
  ScriptedClock clock;
  Scheduler scheduler{clock, every_millisecond()};
  ScriptedTask first{clock, {100us, 100us, 100us, 100us}}, second{clock, {}};
  scheduler.add({.name = "first", .budget = 200us}, first);
  scheduler.add({.name = "second", .period_ticks = 3, .offset_ticks = 1, .budget = 200us}, second);
  scheduler.start();
  scheduler.run_until(6ms);
  CHECK(first.starts == Instants{0ms, 1ms, 2ms, 3ms, 4ms, 5ms});
  CHECK(second.starts == Instants{1100us, 4000us});
}

TEST_CASE("a schedule across the wrap of 32-bit microseconds keeps its phase") {
  ScriptedClock clock;
  clock.pass(std::chrono::microseconds{(1LL << 32) - 1500});
  Scheduler scheduler{clock, every_millisecond()};
  ScriptedTask task{clock, {}};
  scheduler.add({.name = "task", .period_ticks = 2, .budget = 200us}, task);
  const Instant begun = clock.now();
  scheduler.start();
  scheduler.run_until(begun + 5ms);
  CHECK(task.starts == Instants{begun, begun + 2ms, begun + 4ms});
}

TEST_CASE("background work fills the slack up to the guard and never delays the next tick") {
  ScriptedClock clock;
  Scheduler scheduler{clock, every_millisecond()};
  ScriptedTask task{clock, {}};
  ScriptedBackground fit{clock, 100, 200us};
  scheduler.add({.name = "task", .budget = 200us}, task);
  scheduler.add_background({.name = "fit", .quantum = 200us}, fit);
  scheduler.start();
  scheduler.run_until(3ms);
  // 900 us to the guard: four steps of 200 us fit, a fifth would end at 1000 us.
  CHECK(scheduler.background()[0].runs == 12);
  CHECK(task.starts == Instants{0ms, 1ms, 2ms});
  CHECK(scheduler.missed_ticks() == 0);
}

TEST_CASE("a step that overruns its quantum is charged by its peak from then on") {
  ScriptedClock clock;
  Scheduler scheduler{clock, every_millisecond()};
  ScriptedTask task{clock, {}};
  ScriptedBackground fit{clock, 1000, 400us};
  scheduler.add({.name = "task", .budget = 200us}, task);
  scheduler.add_background({.name = "fit", .quantum = 200us}, fit);
  scheduler.start();
  scheduler.run_until(2ms);
  // At 800 us its peak of 400 us no longer fits before 900 us.
  CHECK(fit.starts == Instants{0us, 400us, 1000us, 1400us});
  CHECK(scheduler.background()[0].overruns == 4);
}

TEST_CASE("a background task that never fits is forced after the starvation limit") {
  ScriptedClock clock;
  auto settings = every_millisecond();
  settings.starvation_ticks = 10;
  Scheduler scheduler{clock, settings};
  ScriptedTask busy{clock, std::vector<Duration>(40, 800us)};  // leaves 100 us before the guard
  ScriptedBackground fit{clock, 3, 150us};
  scheduler.add({.name = "busy", .budget = 900us}, busy);
  scheduler.add_background({.name = "fit", .quantum = 150us}, fit);
  scheduler.start();
  scheduler.run_until(31ms);
  CHECK(fit.starts == Instants{9ms + 800us, 19ms + 800us, 29ms + 800us});
  CHECK(scheduler.background()[0].forced == 3);
  CHECK(scheduler.missed_ticks() == 0);  // the overrun of 50 us is within the guard and the tolerance
}

TEST_CASE("two background tasks take turns") {
  ScriptedClock clock;
  Scheduler scheduler{clock, every_millisecond()};
  ScriptedBackground a{clock, 2, 300us}, b{clock, 2, 300us};
  scheduler.add_background({.name = "a", .quantum = 300us}, a);
  scheduler.add_background({.name = "b", .quantum = 300us}, b);
  scheduler.start();
  scheduler.run_until(2ms);
  CHECK(a.starts == Instants{0us, 600us});
  CHECK(b.starts == Instants{300us, 1000us});
}

TEST_CASE("a late wake-up is measured and is nobody's fault") {
  ScriptedClock clock;
  clock.oversleep = 1300us;
  Scheduler scheduler{clock, every_millisecond()};
  ScriptedTask task{clock, {}};
  scheduler.add({.name = "task", .budget = 200us}, task);
  scheduler.start();
  scheduler.run_tick();
  CHECK(scheduler.wake_up().max() == 1300us);
  CHECK(scheduler.missed_ticks() == 1);
  CHECK(scheduler.last_miss().task == Scheduler::no_task);
}

TEST_CASE("the first ticks stay out of the statistics") {
  ScriptedClock clock;
  Scheduler scheduler{clock, {.tick = 1ms, .warm_up_ticks = 3}};
  ScriptedTask task{clock, {700us, 700us, 700us, 10us, 20us}};
  scheduler.add({.name = "task", .budget = 200us}, task);
  scheduler.start();
  scheduler.run_until(5ms);
  CHECK(scheduler.tasks()[0].runs == 2);
  CHECK(scheduler.tasks()[0].overruns == 0);
  CHECK(scheduler.tasks()[0].cost.max() == 20us);
  CHECK(scheduler.slack().count() == 2);
  CHECK(scheduler.wake_up().count() == 2);
}

TEST_CASE("a first tick that takes long keeps the phase and counts as no miss") {
  ScriptedClock clock;
  Scheduler scheduler{clock, {.tick = 1ms, .warm_up_ticks = 2}};
  ScriptedTask task{clock, {4300us, 0us, 3300us}};
  scheduler.add({.name = "task", .budget = 200us}, task);
  scheduler.start();
  scheduler.run_tick();
  CHECK(scheduler.missed_ticks() == 0);
  CHECK(scheduler.misses_in_a_row() == 0);
  scheduler.run_tick();
  scheduler.run_tick();
  CHECK(task.starts == Instants{0ms, 5ms, 6ms});
  CHECK(scheduler.missed_ticks() == 3);
}

TEST_CASE("the running task can be read from inside it and from outside none runs") {
  ScriptedClock clock;
  Scheduler scheduler{clock, every_millisecond()};
  int seen = Scheduler::no_task;
  auto look = [&](Instant) { seen = scheduler.running_task(); };
  FunctionTask<decltype(look)> task{look};
  ScriptedTask other{clock, {}};
  scheduler.add({.name = "other"}, other);
  const int id = scheduler.add({.name = "looker"}, task);
  scheduler.start();
  scheduler.run_tick();
  CHECK(seen == id);
  CHECK(scheduler.running_task() == Scheduler::no_task);
}

TEST_CASE("a schedule started again after a pause begins anew, and its first ticks are left out once more") {
  ScriptedClock clock;
  Scheduler scheduler{clock, {.tick = 1ms, .warm_up_ticks = 2, .starvation_ticks = 3}};
  ScriptedTask task{clock, std::vector<Duration>(20, 950us)};  // leaves no room for a background step
  ScriptedBackground fit{clock, 100, 60us};
  scheduler.add({.name = "task", .budget = 960us}, task);
  scheduler.add_background({.name = "fit", .quantum = 60us}, fit);

  scheduler.start();
  scheduler.run_until(5ms);
  CHECK(scheduler.tasks()[0].runs == 3);
  CHECK(scheduler.wake_up().count() == 3);
  const auto before = fit.starts.size();

  clock.stand_at(1s);  // the pause is no miss, and nothing has starved in it
  scheduler.start();
  CHECK(scheduler.next_tick() == 1s);
  scheduler.run_until(1002ms);
  CHECK(fit.starts.size() == before);
  CHECK(scheduler.tasks()[0].runs == 3);  // the warm-up once more
  scheduler.run_until(1005ms);
  CHECK(scheduler.tasks()[0].runs == 6);
  CHECK(scheduler.wake_up().max() == 10us);  // a forced step ran 10 us into the next tick
  CHECK(scheduler.missed_ticks() == 0);
  CHECK(scheduler.ticks() == 10);
}
