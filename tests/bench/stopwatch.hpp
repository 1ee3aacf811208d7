// How the benchmarks take time: several runs after one that is not counted, the median to quote and the least
// beside it (what the machine can do when nothing else is at work).
#pragma once

#include <algorithm>
#include <chrono>
#include <vector>

namespace moldloft::bench {

struct Seconds {
  double median = 0, least = 0;
};

template <typename Work>
Seconds time_of(int runs, Work&& work) {
  using Clock = std::chrono::steady_clock;
  work();
  std::vector<double> taken(static_cast<std::size_t>(runs));
  for (double& seconds : taken) {
    const auto start = Clock::now();
    work();
    seconds = std::chrono::duration<double>(Clock::now() - start).count();
  }
  std::ranges::sort(taken);
  return {taken[taken.size() / 2], taken.front()};
}

// Keeps the compiler from leaving out what computes `value`.
template <typename T>
inline void keep(const T& value) {
  asm volatile("" : : "r,m"(value) : "memory");
}

}  // namespace moldloft::bench
