#include "hal/base/clock.hpp"

#include <doctest/doctest.h>

#include <csignal>
#include <ctime>
#include <sys/time.h>

using namespace moldloft::hal;
using namespace std::chrono_literals;

namespace {

Duration monotonic() {
  timespec t{};
  clock_gettime(CLOCK_MONOTONIC, &t);
  return std::chrono::seconds{t.tv_sec} + std::chrono::nanoseconds{t.tv_nsec};
}

volatile std::sig_atomic_t interruptions = 0;
void interrupt(int) { interruptions = interruptions + 1; }

// Sends this process a signal every millisecond, with a handler that does not have sleeps taken up again.
class Interruptions {
 public:
  Interruptions() {
    struct sigaction action {};
    action.sa_handler = interrupt;
    ::sigaction(SIGALRM, &action, &before_);
    const itimerval often{.it_interval = {0, 1000}, .it_value = {0, 1000}};
    ::setitimer(ITIMER_REAL, &often, nullptr);
  }
  ~Interruptions() {
    const itimerval never{};
    ::setitimer(ITIMER_REAL, &never, nullptr);
    ::sigaction(SIGALRM, &before_, nullptr);
  }
  Interruptions(const Interruptions&) = delete;
  Interruptions& operator=(const Interruptions&) = delete;

 private:
  struct sigaction before_ {};
};

}  // namespace

TEST_CASE("a sleep that signals interrupt goes on to its deadline") {
  SteadyClock clock;
  const Instant wake = clock.now() + 100ms;
  {
    const Interruptions every_millisecond;
    clock.sleep_until(wake);
  }
  CHECK(clock.now() >= wake);
  CHECK(interruptions > 0);
}

TEST_CASE("periodic work begins half a millisecond beside the kernel's, soon and not in the past") {
  for (int i = 0; i < 100; ++i) {
    SteadyClock clock;
    // The clock's zero in the kernel's time is known to the nearest of many readings.
    Duration zero{0}, narrowest = 1s;
    for (int k = 0; k < 50; ++k) {
      const Duration before = monotonic(), at = clock.now(), after = monotonic();
      if (after - before < narrowest) narrowest = after - before, zero = before - at;
    }
    const Instant earliest = clock.now(), start = clock.good_start(), latest = clock.now();
    CHECK(start > earliest);
    CHECK(start <= latest + 1500us);
    const Duration beside = (start + zero) % 1ms;
    CHECK(beside > 500us - narrowest - 1us);
    CHECK(beside < 500us + narrowest + 1us);
  }
}
