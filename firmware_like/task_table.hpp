// The controller's task table: its rows are known when the program is written, so they are proven then. Budgets are
// for the slowest processor that we admit; what a run really took stands beside them in its timing report.
#pragma once

#include <array>

#include "tasks/scheduler.hpp"

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

inline constexpr tasks::BackgroundSpec surface_work{.name = "surface", .quantum = 200us};

// The shortest tick that leaves room for the table, its guard time and one background step.
inline constexpr hal::Duration shortest_tick =
    tasks::busiest_tick(task_table) + tasks::SchedulerSettings{}.guard + 1us;

static_assert(!tasks::check_table(task_table, tasks::SchedulerSettings{}.tick,
                                  tasks::SchedulerSettings{}.guard));

}  // namespace moldloft::firmware_like
