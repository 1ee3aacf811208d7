// Must compile: a background task that works in memory that it has.
#include "hal/base/realtime.hpp"
#include "tasks/scheduler/scheduler.hpp"

#include <vector>

namespace {

class Adds final : public moldloft::tasks::BackgroundTask {
 public:
  bool has_work() const override { return !done_; }
  void step(moldloft::tasks::Instant) override {
    for (const double value : values_) sum_ += value;
    done_ = true;
  }

 private:
  std::vector<double> values_ = std::vector<double>(100);
  double sum_ = 0;
  bool done_ = false;
};

[[maybe_unused]] Adds task;

}  // namespace
