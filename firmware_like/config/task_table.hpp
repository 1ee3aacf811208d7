// The controller's task table. Its rows are known at compile time, so they are proven then. Budgets are for
// the slowest processor that we admit; a run's timing report shows the real times beside them.
#pragma once

#include "tasks/scheduler/scheduler.hpp"

#include <array>

namespace moldloft::firmware_like {

using namespace std::chrono_literals;

// The order of the rows is the order in a tick: bytes in, decide, bytes out, look after ourselves.
inline constexpr std::array<tasks::TaskSpec, 6> task_table{{
    {.name = "scanner in", .budget = 200us},
    {.name = "robot in", .budget = 50us},
    {.name = "cell", .budget = 300us},
    {.name = "robot out", .budget = 50us},
    {.name = "scanner out", .budget = 50us},
    {.name = "health", .period_ticks = 100, .budget = 20us, .criticality = tasks::Criticality::ordinary},
}};

// The longest step seeks a corner on the whole boundary that a frame shows. It takes 206 us on a processor of
// 500 million instructions a second (toolchain/cell-pc, whose gate holds all steps to the quantum). In
// virtual time a step is charged what a small controller of today takes for it.
inline constexpr tasks::BackgroundSpec surface_work{.name = "surface", .quantum = 240us, .nominal = 12us};

// Four steps on a controller of today, a quarter of one on the slowest. A step that runs longer makes the
// next tick late, but up to 100 us late does not count as missed.
inline constexpr hal::Duration slack_guard = 50us;

// The shortest tick that leaves room for the table, its guard time and one background step. As long as the
// tasks keep their budgets, no background work can starve under it.
inline constexpr hal::Duration shortest_tick =
    tasks::busiest_tick(task_table) + slack_guard + surface_work.quantum;
// At 30 ticks within the robot's 3 s of silence the cell still answers in time.
inline constexpr hal::Duration longest_tick = 100ms;

static_assert(!tasks::check_table(task_table, 1ms, slack_guard));
static_assert(shortest_tick <= 1ms, "the tick that the cell is made for");

}  // namespace moldloft::firmware_like
