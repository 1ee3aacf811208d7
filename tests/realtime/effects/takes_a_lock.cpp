// Must not compile: a task that takes a lock.
#include "hal/base/realtime.hpp"
#include "tasks/scheduler/scheduler.hpp"

#include <mutex>

namespace {

class Locks final : public moldloft::tasks::Task {
 public:
  void run(moldloft::tasks::Instant) override { const std::lock_guard guard{mutex_}; }

 private:
  std::mutex mutex_;
};

[[maybe_unused]] Locks task;

}  // namespace
