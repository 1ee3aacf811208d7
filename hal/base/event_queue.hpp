// What a driver has to say, in order, until it is asked. The cell takes one event a tick. A full queue drops
// the newest and counts it: an old event must not be overtaken by its own consequence.
//
// Thread       one thread
// Allocation   none
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

namespace moldloft::hal {

template <typename T, std::size_t capacity>
class EventQueue {
 public:
  void push(const T& event) noexcept {
    if (count_ == capacity) {
      ++dropped_;
      return;
    }
    events_[(first_ + count_) % capacity] = event;
    ++count_;
  }
  std::optional<T> pop() noexcept {
    if (count_ == 0) return std::nullopt;
    const T& event = events_[first_];
    first_ = (first_ + 1) % capacity;
    --count_;
    return event;
  }
  std::uint64_t dropped() const noexcept { return dropped_; }

 private:
  std::array<T, capacity> events_{};
  std::size_t first_ = 0, count_ = 0;
  std::uint64_t dropped_ = 0;
};

}  // namespace moldloft::hal
