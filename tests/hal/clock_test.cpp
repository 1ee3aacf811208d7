#include "hal/clock.hpp"

#include <doctest/doctest.h>

#include <ctime>

using namespace moldloft::hal;
using namespace std::chrono_literals;

namespace {

Duration monotonic() {
  timespec t{};
  clock_gettime(CLOCK_MONOTONIC, &t);
  return std::chrono::seconds{t.tv_sec} + std::chrono::nanoseconds{t.tv_nsec};
}

}  // namespace

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
