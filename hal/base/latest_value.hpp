// The latest value of something, from one writer to any reader, without blocking (a sequence lock). The
// writer never waits; a reader that was overtaken reads again.
//
// Thread       set(): one thread. get(): any.
// Blocking     set() never; get() for as long as set() runs at the same moment
// Allocation   none
#pragma once

#include <array>
#include <atomic>
#include <bit>
#include <cstdint>
#include <type_traits>

namespace moldloft::hal {

template <typename T>
requires std::is_trivially_copyable_v<T> &&(sizeof(T) % sizeof(std::uint64_t) == 0) class LatestValue {
 public:
  void set(const T& value) noexcept {
    const auto words = std::bit_cast<Words>(value);
    const std::uint64_t turn = turn_.load(std::memory_order_relaxed);
    turn_.store(turn + 1, std::memory_order_relaxed);  // odd: being written
    for (std::size_t i = 0; i < words.size(); ++i) words_[i].store(words[i], std::memory_order_release);
    turn_.store(turn + 2, std::memory_order_release);
  }
  T get() const noexcept {
    for (;;) {
      const std::uint64_t before = turn_.load(std::memory_order_acquire);
      Words words;
      for (std::size_t i = 0; i < words.size(); ++i) words[i] = words_[i].load(std::memory_order_acquire);
      if (before % 2 == 0 && before == turn_.load(std::memory_order_relaxed)) return std::bit_cast<T>(words);
    }
  }

 private:
  using Words = std::array<std::uint64_t, sizeof(T) / sizeof(std::uint64_t)>;

  std::atomic<std::uint64_t> turn_{0};
  std::array<std::atomic<std::uint64_t>, std::tuple_size_v<Words>> words_{};
};

}  // namespace moldloft::hal
