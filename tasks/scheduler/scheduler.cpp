#include "tasks/scheduler/scheduler.hpp"

#include <algorithm>
#include <cassert>

namespace moldloft::tasks {

using hal::FlightKind;

namespace {

bool is_longest(const Histogram& so_far, Duration d) { return so_far.empty() || d > so_far.max(); }

// What control tasks and background work have in common; true when the run kept what was declared.
template <class Record>
bool add_run(Record& record, Instant began, Duration cost, Duration declared) {
  ++record.runs;
  if (is_longest(record.cost, cost)) record.longest_at = began;
  record.cost.add(cost);
  if (cost <= declared) return true;
  ++record.overruns;
  return false;
}

}  // namespace

int Scheduler::add(const TaskSpec& spec, Task& task) {
  assert(task_count_ < max_tasks && spec.period_ticks > 0 && spec.offset_ticks < spec.period_ticks);
  tasks_[task_count_] = &task;
  records_[task_count_].spec = spec;
  const int id = static_cast<int>(task_count_++);
  if (flight_ != nullptr) flight_->name(id, spec.name);
  return id;
}

int Scheduler::add_background(const BackgroundSpec& spec, BackgroundTask& task) {
  assert(background_count_ < max_background);
  background_[background_count_] = &task;
  background_records_[background_count_].spec = spec;
  peak_[background_count_].fill(spec.quantum);
  const int id = background_base + static_cast<int>(background_count_++);
  if (flight_ != nullptr) flight_->name(id, spec.name);
  return id;
}

std::string_view Scheduler::name_of(int task) const {
  if (task >= background_base)
    return background_records_[static_cast<std::size_t>(task - background_base)].spec.name;
  if (task >= 0) return records_[static_cast<std::size_t>(task)].spec.name;
  return "none";
}

void Scheduler::start() {
  next_tick_ = clock_.good_start();
  spent_before_ = clock_.thread_time();
  number_ = 0;
  started_after_ = ticks_;
  last_run_tick_.fill(ticks_);
}

bool Scheduler::run_tick() {
  clock_.sleep_until(next_tick_);
  woken_ = clock_.now();
  Instant t = woken_;
  ++ticks_;
  longest_task_ = no_task;
  longest_cost_ = Duration{0};
  if (flight_ != nullptr) flight_->tick(woken_, woken_ - next_tick_, number_);
  if (warm()) {
    if (is_longest(wake_up_, woken_ - next_tick_)) latest_wake_up_ = woken_;
    wake_up_.add(woken_ - next_tick_);
  }

  run_table(next_tick_, t);
  const Instant following = next_tick_ + settings_.tick;
  if (warm()) {
    execution_.add(t - woken_);
    slack_.add(following - t);
  }
  run_background(t, following - settings_.guard);
  running_.store(no_task, std::memory_order_relaxed);

  next_tick_ = following;
  ++number_;
  const bool goes_on = count_missed(t);
  heartbeat_.store(ticks_, std::memory_order_relaxed);
  // Between two ticks nobody waits for it, and a sleeping thread spends nothing: this is also what it had spent when
  // the next tick began.
  spent_before_ = clock_.thread_time();
  return goes_on;
}

void Scheduler::run_until(Instant end) {
  while (next_tick_ < end && run_tick()) {
  }
}

void Scheduler::run_table(Instant tick_start, Instant& t) {
  // A start is late when even the budgets before it do not explain it.
  Instant allowed_start = tick_start + settings_.guard;
  for (std::size_t i = 0; i < task_count_; ++i) {
    const TaskSpec& spec = records_[i].spec;
    // Most tasks run at every tick, and a division costs as much as a clock read.
    if (spec.period_ticks != 1 && number_ % spec.period_ticks != spec.offset_ticks) continue;
    running_.store(static_cast<int>(i), std::memory_order_relaxed);
    const Instant began = t;
    tasks_[i]->run(began);
    t = clock_.now();
    const Duration cost = t - began;
    if (cost > longest_cost_) {
      longest_cost_ = cost;
      longest_task_ = static_cast<int>(i);
    }
    if (flight_ != nullptr) flight_->note(FlightKind::task, static_cast<int>(i), began, cost);
    count_run(i, began, cost, allowed_start);
    allowed_start += spec.budget;
  }
}

void Scheduler::count_run(std::size_t i, Instant began, Duration cost, Instant allowed_start) {
  if (!warm()) return;
  TaskRecord& record = records_[i];
  if (began > allowed_start) {
    ++record.late_starts;
    record.lateness += began - allowed_start;
  }
  if (add_run(record, began, cost, record.spec.budget)) return;
  if (flight_ != nullptr && record.spec.criticality == Criticality::vital)
    flight_->trigger(hal::FlightCause::overrun, static_cast<int>(i), began + cost);
}

void Scheduler::run_background(Instant& t, Instant limit) {
  if (background_count_ == 0) return;
  const Instant following = limit + settings_.guard, before_all = std::max(t, following);
  bool may_force = true, stepped = false;
  for (std::size_t without_step = 0; without_step < background_count_;) {
    const std::size_t i = next_background_;
    next_background_ = (next_background_ + 1) % background_count_;
    const Instant before = t;
    without_step = step_background(i, t, limit, may_force) && t < limit ? 0 : without_step + 1;
    stepped = stepped || t != before;
  }
  if (stepped && warm()) pushed_.add(t - before_all);
}

bool Scheduler::step_fits(std::size_t i, std::size_t kind, Instant t, Instant limit) const {
  const Duration quantum = background_records_[i].spec.quantum;
  const Instant latest_end = limit + settings_.guard + settings_.late_tolerance;
  if (kind == 0) return t + std::max(quantum, peak_[i][kind]) <= limit;
  return t + peak_[i][kind] <= limit && t + quantum <= latest_end;
}

// Upwards at once, and down by 1/128 of the difference a run: one preempted step does not keep the task out for long.
void Scheduler::follow_peak(std::size_t i, std::size_t kind, Duration cost) {
  Duration& peak = peak_[i][kind];
  const Duration floor = kind == 0 ? std::max(background_records_[i].spec.quantum, cost) : cost;
  peak = std::max(floor, peak - (peak - floor) / 128);
}

bool Scheduler::step_background(std::size_t i, Instant& t, Instant limit, bool& may_force) {
  auto& record = background_records_[i];
  if (!background_[i]->has_work()) {
    last_run_tick_[i] = ticks_;
    return false;
  }
  const std::size_t kind = background_[i]->next_kind();
  assert(kind < step_kinds);
  if (!step_fits(i, kind, t, limit)) {
    // A forced step may use up the guard time and make the next tick late, never missed. It is not added to a
    // table that is late itself.
    const bool starving = ticks_ - last_run_tick_[i] >= settings_.starvation_ticks;
    const Instant due = limit + settings_.guard;
    if (!starving || !may_force || t > due || t + record.spec.quantum > due + settings_.late_tolerance) {
      if (last_run_tick_[i] != ticks_ && warm()) ++record.refused;
      if (peak_[i][kind] > record.spec.quantum)
        peak_[i][kind] = std::max(record.spec.quantum, peak_[i][kind] / 2);
      return false;
    }
    may_force = false;
    if (warm()) ++record.forced;
  }

  const int id = background_base + static_cast<int>(i);
  running_.store(id, std::memory_order_relaxed);
  const Instant began = t;
  background_[i]->step(std::max(limit, began + record.spec.quantum));
  if (const Instant measured = clock_.now(); measured == began) clock_.charge(record.spec.nominal);
  t = clock_.now();
  const Duration cost = t - began;
  if (flight_ != nullptr) flight_->note(FlightKind::background, id, began, cost);
  follow_peak(i, kind, cost);
  last_run_tick_[i] = ticks_;
  if (warm()) add_run(record, began, cost, record.spec.quantum);
  if (cost > longest_cost_) {
    longest_cost_ = cost;
    longest_task_ = id;
  }
  return true;
}

bool Scheduler::count_missed(Instant t) {
  if (t <= next_tick_ + settings_.late_tolerance) {
    misses_in_a_row_ = 0;
    return true;
  }
  const auto lost =
      static_cast<std::uint64_t>((t - next_tick_ - settings_.late_tolerance - 1ns) / settings_.tick) + 1;
  // The first ticks open links and touch pages: what they cost is no fault of the run.
  if (warm()) {
    keep_miss(t, lost);
    missed_ += lost;
    ++misses_in_a_row_;
  }
  // Made up for at once, the last of them is not lost.
  const std::uint64_t dropped = settings_.missed == MissedTickPolicy::catch_up_once ? lost - 1 : lost;
  count_slips(dropped);
  number_ += dropped;
  next_tick_ += static_cast<std::int64_t>(dropped) * settings_.tick;
  if (settings_.missed == MissedTickPolicy::reanchor) next_tick_ = t;
  return settings_.missed != MissedTickPolicy::stop;
}

void Scheduler::keep_miss(Instant t, std::uint64_t lost) {
  const Duration late = t - next_tick_, wall = t - woken_;
  const Duration spent = std::min(clock_.thread_time() - spent_before_, wall);
  const Duration woken_late = woken_ - (next_tick_ - settings_.tick), waited = wall - spent;
  const MissCause cause = woken_late >= std::max(waited, spent) ? MissCause::woken_late
                          : waited >= spent                     ? MissCause::preempted
                                                                : MissCause::computing;
  last_miss_ = {.tick = number_,
                .at = t,
                .lost = lost,
                .cause = cause,
                .task = cause == MissCause::woken_late ? no_task : longest_task_,
                .late = late,
                .wall = wall,
                .spent = spent};
  missed_by_[static_cast<std::size_t>(cause)] += lost;
  if (first_count_ < misses_kept) first_misses_[first_count_++] = last_miss_;
  if (flight_ == nullptr) return;
  flight_->note(FlightKind::missed, last_miss_.task, t, Duration{static_cast<std::int64_t>(lost)});
  flight_->trigger(hal::FlightCause::missed_tick, last_miss_.task, t);
}

void Scheduler::count_slips(std::uint64_t lost) {
  for (std::size_t i = 0; i < task_count_; ++i) {
    const std::uint64_t period = records_[i].spec.period_ticks, offset = records_[i].spec.offset_ticks;
    // How many of the numbers below n leave `offset` when divided by `period`.
    const auto due_below = [&](std::uint64_t n) { return n <= offset ? 0 : (n - offset - 1) / period + 1; };
    records_[i].slips += due_below(number_ + lost) - due_below(number_);
  }
}

}  // namespace moldloft::tasks
