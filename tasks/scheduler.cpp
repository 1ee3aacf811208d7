#include "tasks/scheduler.hpp"

#include <algorithm>
#include <cassert>

namespace moldloft::tasks {

int Scheduler::add(const TaskSpec& spec, Task& task) {
  assert(task_count_ < max_tasks && spec.period_ticks > 0 && spec.offset_ticks < spec.period_ticks);
  tasks_[task_count_] = &task;
  records_[task_count_].spec = spec;
  return static_cast<int>(task_count_++);
}

int Scheduler::add_background(const BackgroundSpec& spec, BackgroundTask& task) {
  assert(background_count_ < max_background);
  background_[background_count_] = &task;
  background_records_[background_count_].spec = spec;
  peak_[background_count_] = spec.quantum;
  return static_cast<int>(background_base + background_count_++);
}

std::string_view Scheduler::name_of(int task) const {
  if (task >= background_base)
    return background_records_[static_cast<std::size_t>(task - background_base)].spec.name;
  if (task >= 0) return records_[static_cast<std::size_t>(task)].spec.name;
  return "none";
}

void Scheduler::start() {
  next_tick_ = clock_.now();
  number_ = 0;
  last_run_tick_.fill(0);
}

bool Scheduler::run_tick() {
  clock_.sleep_until(next_tick_);
  Instant t = clock_.now();
  ++ticks_;
  longest_task_ = no_task;
  longest_cost_ = Duration{0};
  if (warm()) wake_up_.add(t - next_tick_);

  run_table(next_tick_, t);
  const Instant limit = next_tick_ + settings_.tick - settings_.guard;
  if (warm()) slack_.add(next_tick_ + settings_.tick - t);
  run_background(t, limit);
  running_.store(no_task, std::memory_order_relaxed);

  next_tick_ += settings_.tick;
  ++number_;
  return count_missed(t);
}

void Scheduler::run_until(Instant end) {
  while (next_tick_ < end && run_tick()) {
  }
}

void Scheduler::run_table(Instant tick_start, Instant& t) {
  Duration allowed = settings_.guard;  // a start is late when even the budgets before it do not explain it
  for (std::size_t i = 0; i < task_count_; ++i) {
    auto& record = records_[i];
    if (number_ % record.spec.period_ticks != record.spec.offset_ticks) continue;
    running_.store(static_cast<int>(i), std::memory_order_relaxed);
    const Instant began = t;
    tasks_[i]->run(began);
    t = clock_.now();
    const Duration cost = t - began;
    if (cost > longest_cost_) {
      longest_cost_ = cost;
      longest_task_ = static_cast<int>(i);
    }
    if (warm()) {
      ++record.runs;
      record.cost.add(cost);
      if (cost > record.spec.budget) ++record.overruns;
      if (began - tick_start > allowed) ++record.late_starts;
    }
    allowed += record.spec.budget;
  }
}

void Scheduler::run_background(Instant& t, Instant limit) {
  std::size_t without_step = 0;
  while (background_count_ > 0 && without_step < background_count_) {
    const std::size_t i = next_background_;
    next_background_ = (next_background_ + 1) % background_count_;
    without_step = step_background(i, t, limit) ? 0 : without_step + 1;
  }
}

bool Scheduler::step_background(std::size_t i, Instant& t, Instant limit) {
  auto& record = background_records_[i];
  if (!background_[i]->has_work()) {
    last_run_tick_[i] = ticks_;
    return false;
  }
  const bool starving = ticks_ - last_run_tick_[i] >= settings_.starvation_ticks;
  if (t + peak_[i] > limit && !starving) {
    if (last_run_tick_[i] != ticks_) ++record.refused;
    peak_[i] = std::max(record.spec.quantum, peak_[i] / 2);
    return false;
  }
  if (t + peak_[i] > limit) ++record.forced;

  running_.store(background_base + static_cast<int>(i), std::memory_order_relaxed);
  const Instant began = t;
  background_[i]->step(std::max(limit, began + record.spec.quantum));
  if (const Instant measured = clock_.now(); measured == began) clock_.charge(record.spec.quantum);
  t = clock_.now();
  const Duration cost = t - began;
  // The peak follows upwards at once and comes down by 1/128 of the difference a run: one preempted step does not keep
  // the task out for long.
  peak_[i] = std::max({record.spec.quantum, cost, peak_[i] - (peak_[i] - record.spec.quantum) / 128});
  last_run_tick_[i] = ticks_;
  ++record.runs;
  record.cost.add(cost);
  if (cost > record.spec.quantum) ++record.overruns;
  if (cost > longest_cost_) {
    longest_cost_ = cost;
    longest_task_ = background_base + static_cast<int>(i);
  }
  return t < limit;
}

bool Scheduler::count_missed(Instant t) {
  if (t <= next_tick_ + settings_.late_tolerance) {
    misses_in_a_row_ = 0;
    return true;
  }
  const auto missed =
      static_cast<std::uint64_t>((t - next_tick_ - settings_.late_tolerance - 1ns) / settings_.tick) + 1;
  missed_ += missed;
  ++misses_in_a_row_;
  // When no task ran for most of a tick, the tick itself was begun late: the machine woke us late.
  last_miss_cause_ = longest_cost_ * 2 > settings_.tick ? longest_task_ : no_task;
  number_ += missed;
  next_tick_ += static_cast<std::int64_t>(missed) * settings_.tick;
  if (settings_.missed == MissedTickPolicy::reanchor) next_tick_ = t;
  return settings_.missed != MissedTickPolicy::stop;
}

}  // namespace moldloft::tasks
