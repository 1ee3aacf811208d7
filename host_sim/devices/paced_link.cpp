#include "host_sim/devices/paced_link.hpp"

#include <algorithm>
#include <cassert>
#include <utility>

namespace moldloft::host_sim {
namespace {

using namespace std::chrono_literals;

constexpr hal::Duration step = 1ms;  // how often a device looks at its link

// A device that was stopped for longer does not send at once all that the wire would have carried meanwhile.
constexpr hal::Duration longest_look = 50ms;

double seconds(hal::Duration d) { return std::chrono::duration<double>(d).count(); }

}  // namespace

PacedLink::PacedLink(std::unique_ptr<hal::ByteLink> within, hal::Clock& clock, double bytes_per_second)
    : within_{std::move(within)}, clock_{clock}, bytes_per_second_{bytes_per_second} {
  assert(bytes_per_second * seconds(step) >= 1);
}

std::size_t PacedLink::Pace::room(hal::Instant now, double bytes_per_second) noexcept {
  const double passed = bytes_per_second * seconds(now - std::exchange(last_, now));
  const double most = bytes_per_second * seconds(busy_ ? longest_look : step);
  bytes_ = std::min(bytes_ + passed, most);
  return static_cast<std::size_t>(bytes_);
}

void PacedLink::Pace::moved(std::size_t bytes, bool more_wait) noexcept {
  bytes_ -= static_cast<double>(bytes);
  busy_ = more_wait;
}

std::size_t PacedLink::read(std::span<std::byte> out) noexcept {
  const std::size_t room = std::min(reading_.room(clock_.now(), bytes_per_second_), out.size());
  if (room == 0) return 0;  // asked for nothing, a socket answers as at its end
  const std::size_t count = within_->read(out.first(room));
  reading_.moved(count, count == room);
  return count;
}

std::size_t PacedLink::write(std::span<const std::byte> in) noexcept {
  const std::size_t room = std::min(writing_.room(clock_.now(), bytes_per_second_), in.size());
  const std::size_t count = room == 0 ? 0 : within_->write(in.first(room));
  writing_.moved(count, count < in.size());
  return count;
}

}  // namespace moldloft::host_sim
