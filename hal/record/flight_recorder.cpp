#include "hal/record/flight_recorder.hpp"

#include <algorithm>
#include <bit>
#include <cassert>
#include <cerrno>
#include <span>
#include <unistd.h>

namespace moldloft::hal {
namespace {

constexpr std::uint32_t kept_for_others = 2;  // dumps that overruns and missed ticks leave

template <std::size_t size>
void put_text(std::array<char, size>& to, std::string_view text) noexcept {
  const std::size_t count = std::min(text.size(), size);
  std::fill(std::copy_n(text.begin(), count, to.begin()), to.end(), '\0');
}

bool write_all(int file, std::span<const std::byte> bytes) noexcept {
  while (!bytes.empty()) {
    const ssize_t count = ::write(file, bytes.data(), bytes.size());
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) return false;
    bytes = bytes.subspan(static_cast<std::size_t>(count));
  }
  return true;
}

// What is kept of a ring of `ring.size()` after `written` entries, oldest first: two pieces at most.
template <typename T>
bool write_ring(int file, std::span<const T> ring, std::uint64_t written) noexcept {
  if (written <= ring.size())
    return write_all(file, std::as_bytes(ring.first(static_cast<std::size_t>(written))));
  const auto oldest = static_cast<std::size_t>(written % ring.size());
  return write_all(file, std::as_bytes(ring.subspan(oldest))) &&
         write_all(file, std::as_bytes(ring.first(oldest)));
}

}  // namespace

FlightRecorder::FlightRecorder(const Sizes& sizes)
    : ring_(sizes.events),
      transitions_(sizes.transitions),
      mask_{sizes.events - 1},
      ticks_after_{sizes.ticks_after},
      quiet_{sizes.quiet},
      dumps_left_{sizes.dumps} {
  assert(std::has_single_bit(sizes.events) && sizes.transitions > 0);
}

std::size_t FlightRecorder::plan_bytes() const noexcept {
  return sizeof *this + ring_.size() * sizeof(FlightEvent) + transitions_.size() * sizeof(FlightTransition);
}

void FlightRecorder::name(int task, std::string_view text) noexcept {
  assert(task >= 0 && static_cast<std::size_t>(task) < flight_names);
  put_text(header_.names[static_cast<std::size_t>(task)], text);
}

void FlightRecorder::tick(Instant woken, Duration late, std::uint64_t number) noexcept {
  tick_number_ = number;
  note(FlightKind::tick, 0, woken, late);
  if (requested_.load(std::memory_order_relaxed)) {
    requested_.store(false, std::memory_order_relaxed);
    trigger(FlightCause::request, -1, woken);
  }
  if (state_.load(std::memory_order_relaxed) != State::triggered) return;
  if (ticks_to_freeze_-- == 0) state_.store(State::frozen, std::memory_order_release);
}

void FlightRecorder::transition(const EventRecord& event) noexcept {
  if (frozen()) return;
  FlightTransition& entry = transitions_[transitions_written_++ % transitions_.size()];
  entry.at_ns = event.at.count();
  put_text(entry.source, event.source);
  put_text(entry.event, event.event);
  put_text(entry.from, event.from);
  put_text(entry.to, event.to);
}

void FlightRecorder::trigger(FlightCause cause, int task, Instant at) noexcept {
  const bool is_timing = cause == FlightCause::overrun || cause == FlightCause::missed_tick;
  if (due() || (is_timing && at < quiet_until_)) {
    ++later_triggers_;
    return;
  }
  if (dumps_left() <= (is_timing ? kept_for_others : 0)) return;
  if (is_timing) quiet_until_ = at + quiet_;
  header_.cause = cause;
  header_.task = static_cast<std::uint8_t>(task);
  header_.triggered_ns = at.count();
  header_.tick = tick_number_;
  ticks_to_freeze_ = ticks_after_;
  state_.store(State::triggered, std::memory_order_release);
}

bool FlightRecorder::dump(int file) const noexcept { return dump(file, header_.cause, -1); }

bool FlightRecorder::dump(int file, FlightCause cause, int running_task, int signal) const noexcept {
  FlightHeader header = header_;
  header.cause = cause;
  header.running_task = static_cast<std::uint8_t>(running_task);
  header.signal = static_cast<std::uint16_t>(signal);
  const std::uint64_t written = written_.load(std::memory_order_relaxed);
  header.events = static_cast<std::uint32_t>(std::min<std::uint64_t>(written, ring_.size()));
  header.transitions =
      static_cast<std::uint32_t>(std::min<std::uint64_t>(transitions_written_, transitions_.size()));
  return write_all(file, std::as_bytes(std::span{&header, 1})) &&
         write_ring(file, std::span<const FlightEvent>{ring_}, written) &&
         write_ring(file, std::span<const FlightTransition>{transitions_}, transitions_written_);
}

void FlightRecorder::thaw() noexcept {
  if (!due()) return;
  dumps_left_.fetch_sub(1, std::memory_order_relaxed);
  state_.store(State::running, std::memory_order_release);
}

}  // namespace moldloft::hal
