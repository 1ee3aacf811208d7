#include "hal/base/latest_value.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <atomic>
#include <thread>

using namespace moldloft::hal;

TEST_CASE("a reader sees the latest value") {
  LatestValue<std::array<std::uint64_t, 4>> value;
  CHECK(value.get() == std::array<std::uint64_t, 4>{});
  value.set({1, 2, 3, 4});
  CHECK(value.get() == std::array<std::uint64_t, 4>{1, 2, 3, 4});
}

TEST_CASE("a value that is being written while it is read never comes out torn, and never goes back") {
  LatestValue<std::array<std::uint64_t, 64>> value;
  std::atomic<bool> done{false};
  std::thread writer{[&] {
    std::array<std::uint64_t, 64> next{};
    for (std::uint64_t i = 1; i <= 200'000; ++i) {
      next.fill(i);
      value.set(next);
    }
    done = true;
  }};
  bool whole = true;
  bool forward = true;
  std::uint64_t last = 0;
  while (!done.load()) {
    const auto seen = value.get();
    whole = whole && std::ranges::all_of(seen, [&](std::uint64_t word) { return word == seen[0]; });
    forward = forward && seen[0] >= last;
    last = seen[0];
  }
  writer.join();
  CHECK(whole);
  CHECK(forward);
  CHECK(value.get()[63] == 200'000);
}
