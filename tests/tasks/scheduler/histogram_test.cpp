#include "tasks/scheduler/histogram.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

using moldloft::tasks::Histogram;
using namespace std::chrono_literals;

TEST_CASE("a percentile is at most 1.6 % above the value that a sorted list gives, and never below") {
  Histogram histogram;
  std::vector<std::int64_t> values;
  std::uint64_t state = 1;
  for (int i = 0; i < 20000; ++i) {
    state = state * 6364136223846793005u + 1442695040888963407u;
    const auto ns = static_cast<std::int64_t>((state >> 33) % (std::uint64_t{1} << (4 + i % 30)));
    values.push_back(ns);
    histogram.add(std::chrono::nanoseconds{ns});
  }
  std::sort(values.begin(), values.end());
  for (const double fraction : {0.01, 0.5, 0.9, 0.99, 0.999, 0.9999, 1.0}) {
    const auto exact = values[static_cast<std::size_t>(std::max(0.0, std::ceil(fraction * 20000) - 1))];
    const auto found = histogram.percentile(fraction).count();
    CHECK(found >= exact);
    CHECK(static_cast<double>(found) <= 1.016 * static_cast<double>(exact));
  }
  CHECK(histogram.min().count() == values.front());
  CHECK(histogram.max().count() == values.back());
}

TEST_CASE("a value beyond 68 s goes to the overflow bucket and still counts for the maximum") {
  Histogram histogram;
  histogram.add(100s);
  histogram.add(1us);
  CHECK(histogram.overflows() == 1);
  CHECK(histogram.count() == 2);
  CHECK(histogram.max() == 100s);
  CHECK(histogram.percentile(1.0) == 100s);
}

TEST_CASE("merging two histograms is the same as adding all values to one") {
  Histogram a, b, all;
  for (int i = 0; i < 500; ++i) {
    const auto v = std::chrono::nanoseconds{i * i * 37};
    (i % 3 == 0 ? a : b).add(v);
    all.add(v);
  }
  a.merge(b);
  CHECK(a.count() == all.count());
  CHECK(a.mean() == all.mean());
  for (const double f : {0.1, 0.5, 0.99}) CHECK(a.percentile(f) == all.percentile(f));
}

TEST_CASE("one value alone is its own minimum and mean, with no deviation, zero is a value like others") {
  for (const auto value : {0ns, 1ns, 70'000'000ns}) {
    Histogram histogram;
    histogram.add(value);
    CHECK(histogram.min() == value);
    CHECK(histogram.max() == value);
    CHECK(histogram.mean() == value);
    CHECK(histogram.standard_deviation() == 0ns);
    histogram.add(value + 2us);
    CHECK(histogram.min() == value);
    CHECK(histogram.mean() == value + 1us);
  }
}

TEST_CASE("an empty histogram answers zero") {
  const Histogram histogram;
  CHECK(histogram.min() == 0ns);
  CHECK(histogram.percentile(0.99) == 0ns);
}
