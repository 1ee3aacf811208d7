#include "tasks/scheduler/histogram.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

namespace moldloft::tasks {

std::size_t Histogram::bucket_of(std::uint64_t ns) noexcept {
  // Below 64 ns a bucket is one nanosecond; above, the six bits after the leading one say which part of its octave.
  if (ns < (1u << sub_bits)) return static_cast<std::size_t>(ns);
  const int octave = std::bit_width(ns) - 1 - sub_bits;
  return (static_cast<std::size_t>(octave + 1) << sub_bits) +
         static_cast<std::size_t>((ns >> octave) - (1u << sub_bits));
}

std::uint64_t Histogram::limit_of(std::size_t bucket) noexcept {
  if (bucket < (1u << sub_bits)) return bucket;
  const auto octave = (bucket >> sub_bits) - 1;
  const auto part = (bucket & ((1u << sub_bits) - 1)) + (1u << sub_bits);
  return ((static_cast<std::uint64_t>(part) + 1) << octave) - 1;
}

void Histogram::add(Duration value) noexcept {
  const std::int64_t ns = std::max<std::int64_t>(value.count(), 0);
  ++count_;
  sum_ += ns;
  min_ = std::min(min_, ns);
  max_ = std::max(max_, ns);
  const auto bucket = bucket_of(static_cast<std::uint64_t>(ns));
  if (bucket < buckets) {
    ++counts_[bucket];
  } else {
    ++overflows_;
  }
}

void Histogram::merge(const Histogram& other) noexcept {
  for (std::size_t i = 0; i < buckets; ++i) counts_[i] += other.counts_[i];
  count_ += other.count_;
  overflows_ += other.overflows_;
  sum_ += other.sum_;
  min_ = std::min(min_, other.min_);
  max_ = std::max(max_, other.max_);
}

Histogram::Duration Histogram::mean() const noexcept {
  return Duration{count_ == 0 ? 0 : sum_ / static_cast<std::int64_t>(count_)};
}

Histogram::Duration Histogram::standard_deviation() const noexcept {
  if (count_ < 2) return Duration{0};
  double sum = 0, squares = 0, counted = 0;
  const auto middle_of = [](std::size_t i) {
    return 0.5 * static_cast<double>((lower_limit(i) + upper_limit(i)).count());
  };
  for (std::size_t i = 0; i < buckets; ++i) {
    counted += static_cast<double>(counts_[i]);
    sum += static_cast<double>(counts_[i]) * middle_of(i);
  }
  if (counted < 2) return Duration{0};
  const double mean_ns = sum / counted;
  for (std::size_t i = 0; i < buckets; ++i) {
    const double off = middle_of(i) - mean_ns;
    squares += static_cast<double>(counts_[i]) * off * off;
  }
  return Duration{static_cast<std::int64_t>(std::sqrt(squares / (counted - 1)))};
}

Histogram::Duration Histogram::percentile(double fraction) const noexcept {
  if (count_ == 0) return Duration{0};
  const auto wanted = static_cast<std::uint64_t>(std::ceil(fraction * static_cast<double>(count_)));
  std::uint64_t seen = 0;
  for (std::size_t i = 0; i < buckets; ++i) {
    seen += counts_[i];
    if (seen >= wanted && seen > 0) return std::min(Duration{static_cast<std::int64_t>(limit_of(i))}, max());
  }
  return max();
}

}  // namespace moldloft::tasks
