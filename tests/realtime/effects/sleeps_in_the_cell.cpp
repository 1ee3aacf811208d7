// Must not compile: the promise covers what a task calls, however deep. Here it sleeps two calls down.
#include "hal/base/clock.hpp"
#include "tasks/scheduler/scheduler.hpp"

namespace {

using namespace moldloft;

class Sleeps final : public tasks::Task {
 public:
  explicit Sleeps(hal::Clock& clock) : clock_{clock} {}
  void run(tasks::Instant now) override { settle(now); }

 private:
  void settle(tasks::Instant now) { pause(now + std::chrono::milliseconds{1}); }
  void pause(tasks::Instant until) { clock_.sleep_until(until); }
  hal::Clock& clock_;
};

[[maybe_unused]] void make(hal::Clock& clock) { const Sleeps task{clock}; }

}  // namespace
