// Must not compile: a background task that grows a vector in its step.
#include "hal/base/realtime.hpp"
#include "tasks/scheduler/scheduler.hpp"

#include <vector>

namespace {

class Grows final : public moldloft::tasks::BackgroundTask {
 public:
  bool has_work() const override { return true; }
  void step(moldloft::tasks::Instant) override { values_.resize(values_.size() + 1); }

 private:
  std::vector<double> values_;
};

[[maybe_unused]] Grows task;

}  // namespace
