// The flight recorder: the last second or so of ticks, always on, in a ring of fixed size. A trigger freezes
// it a few ticks later, so that a dump shows the causes and the consequences. Another thread writes the dump
// and lets the recorder run on.
//
// Thread       name(), tick(), note(), transition(), trigger(): the control thread. frozen(), due(), dump(),
//              thaw(): one other thread; dump() also from a signal handler, where it is the last thing that happens
// Blocking     never, but dump() writes to a file
// Allocation   in the constructor only
// Cost         note() about 3 ns: 16 bytes into a ring
// Failure      a trigger while another is being dumped, or too soon after it, is counted in later_triggers()
//              and otherwise ignored; after `dumps` dumps triggers are ignored, so that a sick machine does not
//              fill its disk
#pragma once

#include "hal/base/realtime.hpp"
#include "hal/record/flight_dump.hpp"

#include <array>
#include <atomic>
#include <cstdint>
#include <vector>

namespace moldloft::hal {

class FlightRecorder {
 public:
  struct Sizes {
    std::size_t events =
        1u << 14;  // a power of two; 16 bytes each. A quiet tick takes ten, a busy one twenty
    std::size_t transitions = 64;
    std::uint32_t ticks_after = 20;  // from the trigger to the freeze
    std::uint32_t dumps = 8;         // of one run; the last two are kept for aborts and requests
    // Between two overruns or missed ticks that are dumped: a sick machine must not spend all dumps on
    // its first second.
    Duration quiet = std::chrono::seconds{2};
  };

  FlightRecorder() : FlightRecorder{Sizes{}} {}
  explicit FlightRecorder(const Sizes&);

  // ---- the control thread
  void name(int task, std::string_view) noexcept;  // 0..126, before the first tick
  void tick(Instant woken, Duration late, std::uint64_t number) noexcept MOLDLOFT_NONBLOCKING;
  void note(FlightKind kind, int id, Instant at, Duration value) noexcept MOLDLOFT_NONBLOCKING {
    note(kind, id, at, value.count() < 0 ? 0u : static_cast<std::uint64_t>(value.count()));
  }
  void bytes(FlightKind kind, int link, Instant at, std::size_t count) noexcept MOLDLOFT_NONBLOCKING {
    note(kind, link, at, std::uint64_t{count});
  }
  void transition(const EventRecord&) noexcept MOLDLOFT_NONBLOCKING;
  void trigger(FlightCause, int task, Instant at) noexcept MOLDLOFT_NONBLOCKING;
  std::uint64_t later_triggers() const noexcept { return later_triggers_; }

  // ---- from anywhere, a signal handler included: the next tick triggers
  void request() noexcept { requested_.store(true, std::memory_order_relaxed); }

  // ---- the other side
  bool frozen() const noexcept { return state_.load(std::memory_order_acquire) == State::frozen; }
  // A trigger has come, whether its ticks have passed or not: what is left to write when the run ends.
  bool due() const noexcept { return state_.load(std::memory_order_acquire) != State::running; }
  // Writes the whole ring, oldest first, as flight_dump.hpp says; false when the file does not take it. Only write(2)
  // and its own stack: fit for a signal handler. The owner of a signal says so by `cause`.
  bool dump(int file) const noexcept;
  bool dump(int file, FlightCause cause, int running_task, int signal = 0) const noexcept;
  void thaw() noexcept;
  std::uint32_t dumps_left() const noexcept { return dumps_left_.load(std::memory_order_relaxed); }

  std::size_t plan_bytes() const noexcept;

 private:
  enum class State : std::uint32_t { running, triggered, frozen };

  void note(FlightKind kind, int id, Instant at, std::uint64_t value) noexcept MOLDLOFT_NONBLOCKING {
    if (state_.load(std::memory_order_relaxed) == State::frozen) return;
    const std::uint64_t n = written_.load(std::memory_order_relaxed);
    ring_[n & mask_] = {.at_ns = at.count(),
                        .value = value > UINT32_MAX ? UINT32_MAX : static_cast<std::uint32_t>(value),
                        .kind = kind,
                        .id = static_cast<std::uint8_t>(id)};
    written_.store(n + 1, std::memory_order_relaxed);
  }

  std::vector<FlightEvent> ring_;
  std::vector<FlightTransition> transitions_;
  std::uint64_t mask_;
  std::atomic<std::uint64_t> written_{0};
  std::uint64_t transitions_written_ = 0;
  std::uint32_t ticks_after_, ticks_to_freeze_ = 0;
  std::uint64_t later_triggers_ = 0, tick_number_ = 0;
  Duration quiet_;
  Instant quiet_until_{0};
  FlightHeader header_{};
  std::atomic<State> state_{State::running};
  std::atomic<bool> requested_{false};
  std::atomic<std::uint32_t> dumps_left_;
};

}  // namespace moldloft::hal
