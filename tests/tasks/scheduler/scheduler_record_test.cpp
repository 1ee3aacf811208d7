// What the scheduler counts and whom it blames, to the nanosecond on a scripted clock.
#include "tasks/scheduler/scheduler.hpp"
#include "tasks/scripted_clock.hpp"

#include <doctest/doctest.h>

#include <array>
#include <cstdlib>
#include <functional>

using namespace moldloft::tasks;
using Instants = std::vector<Instant>;

namespace {

SchedulerSettings every_millisecond(MissedTickPolicy missed = MissedTickPolicy::skip_keep_phase) {
  return {.tick = 1ms, .missed = missed, .warm_up_ticks = 0};
}

// A task that does at each of its runs what a script says.
class ActingTask final : public Task {
 public:
  explicit ActingTask(std::vector<std::function<void()>> acts) : acts_{std::move(acts)} {}
  void run(Instant now) override {
    starts.push_back(now);
    if (starts.size() <= acts_.size() && acts_[starts.size() - 1]) acts_[starts.size() - 1]();
  }
  Instants starts;

 private:
  std::vector<std::function<void()>> acts_;
};

}  // namespace

TEST_CASE("a missed tick is the machine's fault when it woke us late, and says by how much") {
  ScriptedClock clock;
  Scheduler scheduler{clock, every_millisecond()};
  ScriptedTask task{clock, {0us, 40us}};
  scheduler.add({.name = "task", .budget = 200us}, task);
  scheduler.start();
  scheduler.run_tick();
  clock.oversleep = 2500us;
  scheduler.run_tick();
  const auto miss = scheduler.last_miss();
  CHECK(miss.cause == MissCause::woken_late);
  CHECK(miss.task == Scheduler::no_task);
  CHECK(miss.tick == 2);
  CHECK(miss.lost == 2);  // due at 2 and 3 ms, begun at 3.5 ms
  CHECK(miss.at == 3540us);
  CHECK(miss.late == 1540us);
  CHECK(miss.wall == 40us);
  CHECK(miss.spent == 40us);
  CHECK(scheduler.missed_by(MissCause::woken_late) == 2);
}

TEST_CASE("a task that did not have the processor is told from one that used it too long") {
  ScriptedClock clock;
  Scheduler scheduler{clock, every_millisecond()};
  ActingTask victim{{[&] {
                       clock.pass(30us);
                       clock.be_preempted(1200us);
                     },
                     {},
                     [&] { clock.pass(1500us); }}};
  scheduler.add({.name = "victim", .budget = 200us}, victim);
  scheduler.start();
  scheduler.run_tick();
  CHECK(scheduler.last_miss().cause == MissCause::preempted);
  CHECK(scheduler.name_of(scheduler.last_miss().task) == "victim");
  CHECK(scheduler.last_miss().wall == 1230us);
  CHECK(scheduler.last_miss().spent == 30us);
  scheduler.run_tick();
  scheduler.run_tick();
  CHECK(scheduler.last_miss().cause == MissCause::computing);
  CHECK(scheduler.last_miss().spent == 1500us);
  CHECK(scheduler.missed_by(MissCause::preempted) == 1);
  CHECK(scheduler.missed_by(MissCause::computing) == 1);
  REQUIRE(scheduler.first_misses().size() == 2);
  CHECK(scheduler.first_misses()[0].cause == MissCause::preempted);
}

TEST_CASE("caught up once, the last missed tick is done at once and the phase kept") {
  ScriptedClock clock;
  Scheduler scheduler{clock, every_millisecond(MissedTickPolicy::catch_up_once)};
  ScriptedTask task{clock, {3300us}};
  scheduler.add({.name = "task", .budget = 200us}, task);
  scheduler.start();
  scheduler.run_until(6ms);
  // Ticks 1 and 2 are dropped, 3 comes at once at 3.3 ms, then the old beat.
  CHECK(task.starts == Instants{0us, 3300us, 4000us, 5000us});
  CHECK(scheduler.missed_ticks() == 3);
  CHECK(scheduler.tasks()[0].slips == 2);
}

TEST_CASE("runs that fell into missed ticks are counted as slips of their task") {
  ScriptedClock clock;
  Scheduler scheduler{clock, every_millisecond()};
  ScriptedTask slow{clock, {7300us}}, third{clock, {}}, offset{clock, {}}, rare{clock, {}};
  scheduler.add({.name = "slow", .budget = 200us}, slow);
  scheduler.add({.name = "third", .period_ticks = 3}, third);
  scheduler.add({.name = "offset", .period_ticks = 4, .offset_ticks = 1}, offset);
  scheduler.add({.name = "rare", .period_ticks = 100, .offset_ticks = 8}, rare);
  scheduler.start();
  scheduler.run_tick();
  // Ticks 1 to 7 are lost: 3 and 6 of the second row, 1 and 5 of the third, none of the last.
  CHECK(scheduler.missed_ticks() == 7);
  CHECK(scheduler.tasks()[0].slips == 7);
  CHECK(scheduler.tasks()[1].slips == 2);
  CHECK(scheduler.tasks()[2].slips == 2);
  CHECK(scheduler.tasks()[3].slips == 0);
  scheduler.run_tick();
  CHECK(rare.starts == Instants{8ms});
}

TEST_CASE("a late start is one that the budgets before it do not explain, and its lateness adds up") {
  ScriptedClock clock;
  Scheduler scheduler{clock, every_millisecond()};
  ScriptedTask first{clock, {300us, 301us, 350us}}, second{clock, {}};
  scheduler.add({.name = "first", .budget = 200us}, first);
  scheduler.add({.name = "second", .budget = 200us}, second);
  scheduler.start();
  scheduler.run_until(3ms);
  CHECK(scheduler.tasks()[1].late_starts == 2);
  CHECK(scheduler.tasks()[1].lateness == 51us);  // beyond the budget of 200 us and the guard of 100 us
  CHECK(scheduler.tasks()[0].late_starts == 0);
  CHECK(scheduler.tasks()[0].overruns == 3);
}

TEST_CASE("two starving background tasks are not forced in one tick") {
  ScriptedClock clock;
  auto settings = every_millisecond();
  settings.starvation_ticks = 5;
  Scheduler scheduler{clock, settings};
  ScriptedTask busy{clock, std::vector<Duration>(40, 850us)};
  ScriptedBackground a{clock, 10, 150us}, b{clock, 10, 150us};
  scheduler.add({.name = "busy", .budget = 890us}, busy);
  scheduler.add_background({.name = "a", .quantum = 150us}, a);
  scheduler.add_background({.name = "b", .quantum = 150us}, b);
  scheduler.start();
  scheduler.run_until(12ms);
  CHECK(scheduler.missed_ticks() == 0);
  CHECK(a.starts.size() == 2);
  CHECK(b.starts.size() == 2);
  for (std::size_t i = 0; i < a.starts.size(); ++i) CHECK(a.starts[i] / 1ms != b.starts[i] / 1ms);
  // 850 and 150 us fill the tick to the nanosecond: no start was moved.
  for (const Instant start : busy.starts) CHECK(start % 1ms == 0ns);
}

TEST_CASE("background work that keeps its quantum never moves the next tick by more than one quantum") {
  // Whatever the table leaves, whatever the quantum and however many tasks starve: every mixture of a coarse grid.
  Duration worst{0};
  int forced_runs = 0;
  for (const Duration table : {0us, 500us, 790us, 850us, 930us, 999us})
    for (const Duration quantum : {50us, 150us, 400us})
      for (const std::uint32_t starvation : {1u, 3u, 100u}) {
        ScriptedClock clock;
        auto settings = every_millisecond();
        settings.starvation_ticks = starvation;
        Scheduler scheduler{clock, settings};
        ScriptedTask control{clock, std::vector<Duration>(200, table)};
        ScriptedBackground fit{clock, 1000, quantum}, recorder{clock, 1000, quantum},
            display{clock, 1000, quantum};
        scheduler.add({.name = "control", .budget = 1000us}, control);
        for (auto* task : {&fit, &recorder, &display})
          scheduler.add_background({.name = "background", .quantum = quantum}, *task);
        scheduler.start();
        scheduler.run_until(150ms);
        for (const Instant start : control.starts) {
          const Duration moved = start % 1ms;
          CAPTURE(table.count());
          CAPTURE(quantum.count());
          CAPTURE(starvation);
          REQUIRE(moved <= quantum);
          REQUIRE(moved <= settings.late_tolerance);
          worst = std::max(worst, moved);
        }
        for (const auto& record : scheduler.background()) {
          forced_runs += static_cast<int>(record.forced);
          REQUIRE(record.overruns == 0);
        }
        REQUIRE(scheduler.pushed().max() <= quantum);
        REQUIRE(scheduler.missed_ticks() == 0);
        REQUIRE(control.starts.size() == 150);
      }
  CHECK(worst == 100us);  // the tolerance of a late tick: the bound is used, not only kept
  CHECK(forced_runs > 500);
}

TEST_CASE("steps of a kind that costs alike fill the slack by what they were measured to take") {
  ScriptedClock clock;
  Scheduler scheduler{clock, every_millisecond()};
  ScriptedTask task{clock, {}};
  ScriptedBackground look{clock, 100'000, 10us};
  look.kind = 2;
  scheduler.add({.name = "task", .budget = 200us}, task);
  scheduler.add_background({.name = "look", .quantum = 200us}, look);
  scheduler.start();
  scheduler.run_tick();
  // The first is counted as the quantum; then the peak comes down by 1/128 of the rest a run. The last start of the
  // tick is the largest n with 10 n + 10 + 190 (127/128)^n <= 900.
  REQUIRE(look.starts.size() == 79);
  CHECK(look.starts[1] == 10us);
  for (int i = 0; i < 20; ++i) scheduler.run_tick();
  CHECK(look.starts.back() ==
        20ms + 880us);  // up to the guard, but for the last 127 ns of the peak, which stay
  // One piece takes the whole quantum after all: the next tick is late, not missed, and the peak knows.
  look.cost = 200us;
  scheduler.run_tick();
  CHECK(scheduler.missed_ticks() == 0);
  CHECK(scheduler.pushed().max() == 0us);
  look.cost = 10us;
  const std::size_t before = look.starts.size();
  scheduler.run_tick();
  CHECK(look.starts[before] == 22ms);
  CHECK(look.starts.back() < 22ms + 800us);
}

TEST_CASE("a kind of its own neither knows nor spoils what another kind takes") {
  ScriptedClock clock;
  Scheduler scheduler{clock, every_millisecond()};
  ScriptedBackground look{clock, 100'000, 10us};
  look.kind = 1;
  scheduler.add_background({.name = "look", .quantum = 200us}, look);
  scheduler.start();
  for (int i = 0; i < 30; ++i) scheduler.run_tick();
  CHECK(look.starts.back() == 29ms + 880us);
  look.kind = 0;
  scheduler.run_tick();
  CHECK(look.starts.back() == 30ms + 700us);  // the declared quantum before the guard
  look.kind = 1;
  scheduler.run_tick();
  CHECK(look.starts.back() == 31ms + 880us);
}

TEST_CASE("no width of an older counter is a wrap of ours") {
  // Nanoseconds and microseconds in 32 bits signed and not, milliseconds in 32 bits, ticks in 16 and 32, doubles at
  // 2^53 ns: the schedule begins 2.5 ms before each and goes across it.
  const std::array<Instant, 8> wraps{Instant{1LL << 31},
                                     Instant{1LL << 32},
                                     Instant{(1LL << 31) * 1000},
                                     Instant{(1LL << 32) * 1000},
                                     Instant{(1LL << 31) * 1'000'000},
                                     Instant{(1LL << 32) * 1'000'000},
                                     Instant{65536LL * 1'000'000},
                                     Instant{1LL << 53}};
  for (const Instant wrap : wraps) {
    CAPTURE(wrap.count());
    ScriptedClock clock;
    const Instant begun = wrap - 2500us;
    clock.stand_at(begun);
    Scheduler scheduler{clock, every_millisecond()};
    ScriptedTask task{clock, std::vector<Duration>(10, 10us)};
    ScriptedBackground fit{clock, 1000, 200us};
    scheduler.add({.name = "task", .period_ticks = 2, .budget = 200us}, task);
    scheduler.add_background({.name = "fit", .quantum = 200us}, fit);
    scheduler.start();
    scheduler.run_until(begun + 8ms);
    CHECK(task.starts == Instants{begun, begun + 2ms, begun + 4ms, begun + 6ms});
    CHECK(scheduler.missed_ticks() == 0);
    CHECK(scheduler.wake_up().max() == 0ns);
    CHECK(scheduler.tasks()[0].cost.max() == 10us);
    CHECK(fit.starts.size() == 8 * 4);
  }
}

TEST_CASE("a stall of 70 ms is filed as 70 ms, and one of two minutes in the overflow bucket") {
  ScriptedClock clock;
  Scheduler scheduler{clock, every_millisecond()};
  ScriptedTask task{clock, {70ms, 120s}};
  scheduler.add({.name = "task", .budget = 200us}, task);
  scheduler.start();
  scheduler.run_tick();
  CHECK(scheduler.tasks()[0].cost.max() == 70ms);
  CHECK(scheduler.tasks()[0].cost.percentile(0.5) == 70ms);
  CHECK(scheduler.missed_ticks() == 70 - 1);
  scheduler.run_tick();
  CHECK(scheduler.tasks()[0].cost.overflows() == 1);
  CHECK(scheduler.tasks()[0].cost.max() == 120s);
}

TEST_CASE("one microsecond of lateness skips nothing") {
  ScriptedClock clock;
  clock.oversleep = 1us;
  Scheduler scheduler{clock, every_millisecond()};
  ScriptedTask task{clock, std::vector<Duration>(10, 999us)};
  scheduler.add({.name = "task", .budget = 999us}, task);
  scheduler.start();
  scheduler.run_until(10ms);
  CHECK(task.starts.size() == 10);
  CHECK(scheduler.missed_ticks() == 0);
}

TEST_CASE("the mean rate is exact over a million late wake-ups") {
  ScriptedClock clock;
  Scheduler scheduler{clock, every_millisecond()};
  std::uint64_t runs = 0;
  auto count = [&](Instant) {
    clock.oversleep = std::chrono::nanoseconds{(runs * 7919) % 60'000};
    ++runs;
  };
  FunctionTask<decltype(count)> task{count};
  scheduler.add({.name = "task", .period_ticks = 5}, task);
  scheduler.start();
  scheduler.run_until(1'000s);
  CHECK(runs == 200'000);
  CHECK(scheduler.ticks() == 1'000'000);
  CHECK(scheduler.next_tick() == 1'000s);
}

TEST_CASE("a watchdog sees the running task and a heartbeat that stands still") {
  ScriptedClock clock;
  Scheduler scheduler{clock, every_millisecond()};
  std::uint64_t beat_inside = 99;
  std::string_view name_inside;
  auto look = [&](Instant) {
    beat_inside = scheduler.heartbeat();
    name_inside = scheduler.name_of(scheduler.running_task());
  };
  FunctionTask<decltype(look)> task{look};
  scheduler.add({.name = "stuck"}, task);
  scheduler.start();
  scheduler.run_tick();
  CHECK(beat_inside == 0);
  CHECK(name_inside == "stuck");
  CHECK(scheduler.heartbeat() == 1);
  scheduler.run_tick();
  CHECK(beat_inside == 1);
}

TEST_CASE("the flight recorder is told of ticks, tasks, steps and misses, and frozen by an overrun") {
  ScriptedClock clock;
  moldloft::hal::FlightRecorder flight{{.events = 256, .transitions = 4, .ticks_after = 1, .dumps = 3}};
  Scheduler scheduler{clock, every_millisecond(), &flight};
  ScriptedTask task{clock, {10us, 250us, 20us, 30us, 40us}};
  ScriptedBackground fit{clock, 1, 200us};
  scheduler.add({.name = "task", .budget = 200us}, task);
  scheduler.add_background({.name = "fit", .quantum = 200us}, fit);
  scheduler.start();
  scheduler.run_tick();
  CHECK_FALSE(flight.due());
  scheduler.run_tick();
  CHECK(flight.due());
  CHECK_FALSE(flight.frozen());  // one more tick shows what came of it
  scheduler.run_tick();
  CHECK_FALSE(flight.frozen());
  scheduler.run_tick();
  CHECK(flight.frozen());
}

TEST_CASE("an overrun of an ordinary task does not freeze the flight recorder") {
  ScriptedClock clock;
  moldloft::hal::FlightRecorder flight;
  Scheduler scheduler{clock, every_millisecond(), &flight};
  ScriptedTask task{clock, {250us}};
  scheduler.add({.name = "task", .budget = 200us, .criticality = Criticality::ordinary}, task);
  scheduler.start();
  scheduler.run_tick();
  CHECK(scheduler.tasks()[0].overruns == 1);
  CHECK_FALSE(flight.due());
}

TEST_CASE("a table is refused for each thing that can be wrong with it") {
  const auto flaw_of = [](std::vector<TaskSpec> table) {
    const auto error = check_table(table, 1ms, 100us);
    return error ? static_cast<int>(error->flaw) : -1;
  };
  const TaskSpec good{.name = "good", .budget = 100us};
  CHECK(flaw_of({good}) == -1);
  CHECK(flaw_of(std::vector<TaskSpec>(max_tasks, {.name = "row", .budget = 50us})) == -1);
  CHECK(flaw_of(std::vector<TaskSpec>(max_tasks + 1, {.name = "row", .budget = 1us})) ==
        static_cast<int>(TableFlaw::too_many_rows));
  CHECK(flaw_of({good, {.name = ""}}) == static_cast<int>(TableFlaw::no_name));
  CHECK(flaw_of({good, {.name = "x", .period_ticks = 0}}) == static_cast<int>(TableFlaw::no_period));
  CHECK(flaw_of({{.name = "x", .period_ticks = 2, .offset_ticks = 2}}) ==
        static_cast<int>(TableFlaw::offset_beyond_period));
  CHECK(flaw_of({{.name = "x", .budget = 0us}}) == static_cast<int>(TableFlaw::no_budget));
  CHECK(flaw_of({{.name = "x", .budget = 900us}}) == static_cast<int>(TableFlaw::beyond_the_tick));
  CHECK(flaw_of({{.name = "x", .budget = 899us}}) == -1);
}

TEST_CASE("the busiest tick is the one where offsets let rows meet") {
  const std::array<TaskSpec, 3> apart{{{.name = "a", .period_ticks = 2, .offset_ticks = 0, .budget = 500us},
                                       {.name = "b", .period_ticks = 2, .offset_ticks = 1, .budget = 600us},
                                       {.name = "c", .period_ticks = 4, .offset_ticks = 2, .budget = 30us}}};
  CHECK(busiest_tick(apart) == 600us);
  auto together = apart;
  together[1].offset_ticks = 0;
  together[2].offset_ticks = 1;
  CHECK(busiest_tick(together) == 1100us);
  together[2].offset_ticks = 2;
  CHECK(busiest_tick(together) == 1130us);
  // Primes that meet after 9,409,... ticks count as if they met at once.
  const std::array<TaskSpec, 2> far{{{.name = "a", .period_ticks = 9973, .budget = 5us},
                                     {.name = "b", .period_ticks = 9967, .offset_ticks = 3, .budget = 7us}}};
  CHECK(busiest_tick(far) == 12us);
}

TEST_CASE("when the longest run began and the latest wake-up came is kept, of equals the first") {
  ScriptedClock clock;
  Scheduler scheduler{clock, every_millisecond()};
  ScriptedTask before{clock, std::vector<Duration>(8, 10us)},
      task{clock, {20us, 50us, 30us, 70us, 70us, 40us}};
  ScriptedBackground work{clock, 2, 100us};
  scheduler.add({.name = "before", .budget = 20us}, before);
  ScriptedTask nothing{clock, {}};
  scheduler.add({.name = "task", .budget = 100us}, task);
  scheduler.add({.name = "nothing", .budget = 10us}, nothing);
  scheduler.add_background({.name = "work", .quantum = 200us}, work);
  clock.stand_at(5ms);
  scheduler.start();
  const Instant first = scheduler.next_tick();
  scheduler.run_tick();
  CHECK(scheduler.tasks()[1].longest_at == first + 10us);
  CHECK(scheduler.background()[0].longest_at == first + 30us);
  clock.oversleep = 7us;
  scheduler.run_tick();
  clock.oversleep = 0us;
  work.pieces = 1, work.cost = 150us;
  for (int i = 0; i < 4; ++i) scheduler.run_tick();
  CHECK(scheduler.latest_wake_up() == first + 1007us);
  CHECK(scheduler.tasks()[0].longest_at == first);  // all its runs took 10 us
  CHECK(scheduler.tasks()[1].longest_at == first + 3010us);
  CHECK(scheduler.tasks()[2].longest_at == first + 30us);  // it took no time at all, and that was the longest
  CHECK(scheduler.background()[0].longest_at == first + 2040us);
}

TEST_CASE("start-up ticks count for no background work either") {
  ScriptedClock clock;
  auto settings = every_millisecond();
  settings.warm_up_ticks = 2, settings.starvation_ticks = 2;
  Scheduler scheduler{clock, settings};
  ScriptedTask task{clock, std::vector<Duration>(6, 800us)};
  ScriptedBackground work{clock, 100, 300us};  // never fits: 800 + 300 us
  scheduler.add({.name = "task", .budget = 900us}, task);
  scheduler.add_background({.name = "work", .quantum = 200us}, work);
  scheduler.start();
  const auto& record = scheduler.background()[0];
  for (int i = 0; i < 3; ++i) scheduler.run_tick();
  const auto steps = work.starts.size();
  CHECK(steps > 0);
  CHECK(record.runs + record.refused == 1);  // of the third tick alone
  for (int i = 0; i < 3; ++i) scheduler.run_tick();
  CHECK(record.runs == record.forced);
  CHECK(record.runs + record.refused == 4);
  CHECK(work.starts.size() > record.runs);
  CHECK(record.cost.count() == record.runs);
}

TEST_CASE("start-up ticks are no candidates for the longest run") {
  ScriptedClock clock;
  auto settings = every_millisecond();
  settings.warm_up_ticks = 2;
  Scheduler scheduler{clock, settings};
  ScriptedTask task{clock, {90us, 80us, 10us, 12us}};
  scheduler.add({.name = "task", .budget = 100us}, task);
  scheduler.start();
  const Instant first = scheduler.next_tick();
  for (int i = 0; i < 4; ++i) scheduler.run_tick();
  CHECK(scheduler.tasks()[0].longest_at == first + 3ms);
}
