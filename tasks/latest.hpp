// The latest value of something, written by the control thread and read by others: a sequence lock.
//
// Thread       one writer; any number of readers
// Blocking     the writer never waits; a reader tries again while it is being overtaken
// Allocation   none; T must be trivially copyable
#pragma once

#include <atomic>
#include <cstring>
#include <type_traits>

namespace moldloft::tasks {

template <typename T>
class Latest {
  static_assert(std::is_trivially_copyable_v<T>);
  static constexpr std::size_t word_count = (sizeof(T) + sizeof(std::uint64_t) - 1) / sizeof(std::uint64_t);

 public:
  void store(const T& value) noexcept {
    std::uint64_t words[word_count] = {};
    std::memcpy(words, &value, sizeof value);
    const auto sequence = sequence_.load(std::memory_order_relaxed);
    sequence_.store(sequence + 1, std::memory_order_relaxed);
    std::atomic_thread_fence(std::memory_order_release);
    for (std::size_t i = 0; i < word_count; ++i) words_[i].store(words[i], std::memory_order_relaxed);
    sequence_.store(sequence + 2, std::memory_order_release);
  }

  T load() const noexcept {
    std::uint64_t words[word_count];
    for (;;) {
      const auto before = sequence_.load(std::memory_order_acquire);
      for (std::size_t i = 0; i < word_count; ++i) words[i] = words_[i].load(std::memory_order_relaxed);
      std::atomic_thread_fence(std::memory_order_acquire);
      if (before % 2 == 0 && sequence_.load(std::memory_order_relaxed) == before) break;
    }
    T value;
    std::memcpy(&value, words, sizeof value);
    return value;
  }

 private:
  std::atomic<std::uint64_t> sequence_{0};
  std::atomic<std::uint64_t> words_[word_count] = {};
};

}  // namespace moldloft::tasks
