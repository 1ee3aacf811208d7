// A clock that moves only when a task says what it costs, and tasks that follow a script of costs.
#pragma once

#include "tasks/scheduler/scheduler.hpp"

#include <vector>

namespace moldloft::tasks {

class ScriptedClock final : public hal::Clock {
 public:
  Instant now() noexcept override { return now_; }
  void sleep_until(Instant wake) noexcept override {
    if (wake > now_) now_ = wake;
    now_ += oversleep;
  }
  void charge(Duration) noexcept override {}
  Duration thread_time() noexcept override { return spent_; }
  void pass(Duration d) noexcept {  // the thread computes
    now_ += d;
    spent_ += d;
  }
  void be_preempted(Duration d) noexcept { now_ += d; }
  void stand_at(Instant t) noexcept { now_ = t; }

  Duration oversleep{0};  // how late the next wake-ups are

 private:
  Instant now_{0};
  Duration spent_{0};
};

class ScriptedTask final : public Task {
 public:
  ScriptedTask(ScriptedClock& clock, std::vector<Duration> costs) : clock_{clock}, costs_{std::move(costs)} {}
  void run(Instant now) override {
    starts.push_back(now);
    clock_.pass(starts.size() <= costs_.size() ? costs_[starts.size() - 1] : Duration{0});
  }
  std::vector<Instant> starts;

 private:
  ScriptedClock& clock_;
  std::vector<Duration> costs_;
};

class ScriptedBackground final : public BackgroundTask {
 public:
  ScriptedBackground(ScriptedClock& clock, int how_many, Duration each)
      : pieces{how_many}, cost{each}, clock_{clock} {}
  bool has_work() const override { return pieces > 0; }
  void step(Instant) override {
    starts.push_back(clock_.now());
    --pieces;
    clock_.pass(cost);
  }
  std::size_t next_kind() const override { return kind; }
  int pieces;
  Duration cost;
  std::size_t kind = 0;
  std::vector<Instant> starts;

 private:
  ScriptedClock& clock_;
};

}  // namespace moldloft::tasks
