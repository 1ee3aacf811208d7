#include "tasks/scheduler/clock_drift.hpp"

#include <algorithm>
#include <cmath>

namespace moldloft::tasks {

void ClockDrift::add(hal::Instant ours, std::uint64_t theirs_ns) noexcept {
  if (pairs_++ == 0) first_ours_ = ours, first_theirs_ = theirs_ns;
  const std::int64_t t_ns = (ours - first_ours_).count();
  // Unsigned: the difference is right across a wrap of theirs.
  const auto theirs = static_cast<std::int64_t>(theirs_ns - first_theirs_);
  // Each for itself: their difference is beyond 64 bits where a sensor's clock makes no sense.
  const double t = static_cast<double>(t_ns) * 1e-9,
               d = (static_cast<double>(theirs) - static_cast<double>(t_ns)) * 1e-3;
  sum_t_ += t, sum_d_ += d;
  sum_tt_ += t * t, sum_td_ += t * d, sum_dd_ += d * d;
}

std::optional<ClockDriftEstimate> ClockDrift::estimate() const noexcept {
  if (pairs_ < 3) return std::nullopt;
  const double n = static_cast<double>(pairs_);
  const double tt = sum_tt_ - sum_t_ * sum_t_ / n, td = sum_td_ - sum_t_ * sum_d_ / n,
               dd = sum_dd_ - sum_d_ * sum_d_ / n;
  if (!(tt > 1e-6)) return std::nullopt;
  const double slope = td / tt;  // microseconds a second: parts in a million
  const double scatter = std::sqrt(std::max(0.0, dd - slope * td) / (n - 2));
  return ClockDriftEstimate{
      .ppm = slope, .sigma_ppm = scatter / std::sqrt(tt), .scatter_us = scatter, .pairs = pairs_};
}

}  // namespace moldloft::tasks
