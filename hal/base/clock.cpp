#include "hal/base/clock.hpp"

#include <cerrno>
#include <ctime>

namespace moldloft::hal {
namespace {

Duration reading_of(clockid_t clock) noexcept {
  timespec t{};
  answered_at_once([&] { clock_gettime(clock, &t); });  // shared memory, or a short system call
  return std::chrono::seconds{t.tv_sec} + std::chrono::nanoseconds{t.tv_nsec};
}

}  // namespace

SteadyClock::SteadyClock() noexcept : start_{reading_of(CLOCK_MONOTONIC)} {}

Instant SteadyClock::now() noexcept { return reading_of(CLOCK_MONOTONIC) - start_; }

Instant SteadyClock::good_start() noexcept {
  using std::chrono::milliseconds;
  return std::chrono::ceil<milliseconds>(now() + start_) + std::chrono::microseconds{500} - start_;
}

Duration SteadyClock::thread_time() noexcept { return reading_of(CLOCK_THREAD_CPUTIME_ID); }

void SteadyClock::sleep_until(Instant wake) noexcept {
  const auto absolute = wake + start_;
  const auto seconds = std::chrono::duration_cast<std::chrono::seconds>(absolute);
  const timespec t{.tv_sec = seconds.count(), .tv_nsec = (absolute - seconds).count()};
  // clock_nanosleep returns its error number; it is not in errno, and it is positive.
  while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &t, nullptr) == EINTR) {
  }
}

void VirtualClock::sleep_until(Instant wake) noexcept {
  if (wake > now_) now_ = wake;
  advance(now_);
}

}  // namespace moldloft::hal
