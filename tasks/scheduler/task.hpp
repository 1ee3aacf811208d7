// What the scheduler runs: control tasks, one row of a static table each, and background tasks, which live in the
// slack. check_table() is the table's proof, at compile time where the table is constant.
//
// Thread       run() and step() on the control thread; the checks anywhere
// Blocking     never
// Allocation   none
// Failure      check_table() names the flaw and the row
#pragma once

#include "hal/base/clock.hpp"
#include "hal/base/realtime.hpp"

#include <cstdint>
#include <numeric>
#include <optional>
#include <span>
#include <string_view>

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
  // One bounded piece of work. `deadline` - now is the time left, never less than the declared quantum. A
  // task that can work in slices fills it and returns before it.
  virtual void step(Instant deadline) MOLDLOFT_NONBLOCKING = 0;
  // What kind of piece the next step is, 1 to step_kinds - 1, where the pieces of a kind cost alike. Such a
  // step runs if the measured time of its kind fits. Kind 0: only the declared quantum is certain.
  virtual std::size_t next_kind() const MOLDLOFT_NONBLOCKING { return 0; }
};
inline constexpr std::size_t step_kinds = 8;

enum class Criticality { vital, ordinary };  // an overrun of a vital task freezes the flight recorder

struct TaskSpec {
  std::string_view name;
  std::uint32_t period_ticks = 1;
  std::uint32_t offset_ticks = 0;
  Duration budget = 100us;
  Criticality criticality = Criticality::vital;
};

struct BackgroundSpec {
  std::string_view name;
  Duration quantum = 200us;  // what a step may take on the slowest processor that we admit
  Duration nominal = 200us;  // what it is charged where time is virtual
};

// ---- the proof of a table

inline constexpr std::size_t max_tasks = 16, max_background = 4;

enum class TableFlaw : std::uint8_t {
  too_many_rows,
  no_name,
  no_period,
  offset_beyond_period,
  no_budget,
  beyond_the_tick,  // the budgets of one tick and the guard leave nothing of it
};

struct TableError {
  TableFlaw flaw{};
  std::size_t row = 0;  // the first that is wrong; of beyond_the_tick: 0
};

// The largest sum of budgets that fall due together. Periods with a common multiple beyond 10,000 ticks count
// as if all their rows could meet, which is on the safe side.
constexpr Duration busiest_tick(std::span<const TaskSpec> table) {
  constexpr std::uint64_t longest_cycle = 10'000;
  std::uint64_t cycle = 1;
  Duration all{0};
  for (const TaskSpec& row : table) {
    all += row.budget;
    cycle = cycle > longest_cycle ? cycle : std::lcm(cycle, std::uint64_t{row.period_ticks});
  }
  if (cycle > longest_cycle) return all;
  Duration busiest{0};
  for (std::uint64_t tick = 0; tick < cycle; ++tick) {
    Duration due{0};
    for (const TaskSpec& row : table)
      if (tick % row.period_ticks == row.offset_ticks) due += row.budget;
    if (due > busiest) busiest = due;
  }
  return busiest;
}

constexpr std::optional<TableError> check_table(std::span<const TaskSpec> table, Duration tick,
                                                Duration guard) {
  if (table.size() > max_tasks) return TableError{TableFlaw::too_many_rows, max_tasks};
  for (std::size_t i = 0; i < table.size(); ++i) {
    if (table[i].name.empty()) return TableError{TableFlaw::no_name, i};
    if (table[i].period_ticks == 0) return TableError{TableFlaw::no_period, i};
    if (table[i].offset_ticks >= table[i].period_ticks) return TableError{TableFlaw::offset_beyond_period, i};
    if (table[i].budget <= Duration{0}) return TableError{TableFlaw::no_budget, i};
  }
  if (busiest_tick(table) + guard >= tick) return TableError{TableFlaw::beyond_the_tick, 0};
  return std::nullopt;
}

}  // namespace moldloft::tasks
