// Time as the controller sees it: nanoseconds since the clock's own start, never going back.
//
// Thread       any; now() may be called from every thread
// Blocking     sleep_until() only, and only up to the instant given
// Allocation   none
// Failure      none; an interrupted sleep is taken up again
#pragma once

#include "hal/base/realtime.hpp"

#include <chrono>

namespace moldloft::hal {

using namespace std::chrono_literals;

using Instant = std::chrono::nanoseconds;  // since the start of the clock it came from
using Duration = std::chrono::nanoseconds;

class Clock {
 public:
  virtual ~Clock() = default;

  virtual Instant now() noexcept MOLDLOFT_NONBLOCKING = 0;
  virtual void sleep_until(Instant wake) noexcept = 0;  // returns at once when `wake` has passed

  // A near instant at which something periodic should begin: now, where nothing else is periodic.
  virtual Instant good_start() noexcept MOLDLOFT_NONBLOCKING { return now(); }

  // Processor time of the calling thread, from any origin. Where it grows less than now() does, the thread
  // waited or was ready and did not run. Costs more than now(). In virtual time nothing is ever preempted.
  virtual Duration thread_time() noexcept MOLDLOFT_NONBLOCKING { return now(); }

  // Says that work of this declared cost has just been done. A real clock has seen it pass and ignores the
  // call. A virtual clock moves by it, so that a simulated tick costs what its tasks declare.
  virtual void charge(Duration) noexcept MOLDLOFT_NONBLOCKING {}
};

// CLOCK_MONOTONIC, counted from the construction of the object. Sleeps to absolute deadlines.
class SteadyClock final : public Clock {
 public:
  SteadyClock() noexcept;
  Instant now() noexcept MOLDLOFT_NONBLOCKING override;
  void sleep_until(Instant wake) noexcept override;
  Duration thread_time() noexcept MOLDLOFT_NONBLOCKING override;
  // The kernel does its own periodic work at whole multiples of 1, 4 or 10 ms of this clock, and a thread
  // that wakes then waits 5 us and more for it. So the instant lies within the next two milliseconds, half a
  // one beside the whole.
  Instant good_start() noexcept MOLDLOFT_NONBLOCKING override;

 private:
  Duration start_;
};

// Time that moves only when a thread sleeps or charges a cost. The world that lives in this time (simulated
// devices) is carried along by overriding advance().
class VirtualClock : public Clock {
 public:
  Instant now() noexcept MOLDLOFT_NONBLOCKING final { return now_; }
  void sleep_until(Instant wake) noexcept final;
  void charge(Duration cost) noexcept MOLDLOFT_NONBLOCKING final { now_ += cost; }

 protected:
  // Called with time standing at `wake` each time that a sleep has ended.
  virtual void advance(Instant wake) noexcept { (void)wake; }

 private:
  Instant now_{0};
};

}  // namespace moldloft::hal
