#include "tasks/latest.hpp"

#include <doctest/doctest.h>

#include <thread>

TEST_CASE("a reader never sees half of one value and half of another") {
  struct Pair {
    long a[9];
  };
  moldloft::tasks::Latest<Pair> latest;
  latest.store({});
  std::thread writer{[&] {
    for (long i = 1; i <= 200000; ++i) latest.store({{i, i, i, i, i, i, i, i, i}});
  }};
  bool torn = false;
  long last = 0;
  while (last < 200000) {
    const Pair p = latest.load();
    for (const long v : p.a) torn = torn || v != p.a[0];
    torn = torn || p.a[0] < last;
    last = p.a[0];
  }
  writer.join();
  CHECK_FALSE(torn);
}
