// Straight lines along a stripe: x and z as linear functions of y over a few of its points, and the recursive
// filter that follows a stripe's height from point to point.
//
// Units        mm; slopes are dz/dy and dx/dy
// Cost         fit_line O(points); HeightFilter a handful of operations a point
// Allocation   none
#pragma once

#include "geometry/edges/plate_runs.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <span>

namespace moldloft::geometry {

struct StripeLine {
  double y0 = 0, x0 = 0, z0 = 0;  // the centroid
  double slope_x = 0, slope_z = 0;
  double z_at(double y) const { return z0 + slope_z * (y - y0); }
  double x_at(double y) const { return x0 + slope_x * (y - y0); }
};

// Least squares over the stripe's points named by `good`, which must not be empty. Points that span no length
// in y give slopes of zero.
inline StripeLine fit_line(const StripeView& stripe, std::span<const std::uint32_t> good) {
  StripeLine line;
  const double n = static_cast<double>(good.size());
  for (const std::uint32_t i : good) line.y0 += stripe.y[i], line.x0 += stripe.x[i], line.z0 += stripe.z[i];
  line.y0 /= n, line.x0 /= n, line.z0 /= n;
  double yy = 0, yx = 0, yz = 0;
  for (const std::uint32_t i : good) {
    const double dy = stripe.y[i] - line.y0;
    yy += dy * dy, yx += dy * (stripe.x[i] - line.x0), yz += dy * (stripe.z[i] - line.z0);
  }
  if (yy > 1e-6) line.slope_x = yx / yy, line.slope_z = yz / yy;
  return line;
}

// The line through the points about position y: at most `reach` of them to either side.
inline StripeLine line_about(const StripeView& stripe, std::span<const std::uint32_t> good, double y,
                             std::size_t reach) {
  const auto at =
      std::partition_point(good.begin(), good.end(), [&](std::uint32_t i) { return stripe.y[i] < y; });
  const auto k = static_cast<std::size_t>(at - good.begin());
  const std::size_t first = k > reach ? k - reach : 0;
  const std::size_t last = std::min(good.size(), std::max(k + reach, first + 2));
  return fit_line(stripe, good.subspan(first, last - first));
}

// Follows a height along a stripe with a line whose memory grows to `memory` points and then fades: the
// alpha-beta filter with the gains that reproduce the least-squares line for evenly spaced points while it
// grows (Brookner, "Tracking and Kalman Filtering Made Easy", section 1.2.10).
class HeightFilter {
 public:
  void restart(double y, double z) { y_ = y, level_ = z, slope_ = 0, count_ = 1; }
  double predict(double y) const { return level_ + slope_ * (y - y_); }
  int count() const { return count_; }
  bool is_steady() const { return count_ == memory; }  // its gains do not change any more
  double level() const { return level_; }
  double slope() const { return slope_; }
  // As update() would have left a steady filter.
  void follow(double y, double level, double slope) { y_ = y, level_ = level, slope_ = slope; }

  void update(double y, double z, double spacing) {
    const double dy = y - y_, residual = z - predict(y);
    count_ = std::min(count_ + 1, memory);
    const Gains& gain = gains[count_];
    level_ = z - (1 - gain.level) * residual;
    slope_ = std::clamp(slope_ + gain.slope * residual / std::max(dy, spacing), -max_slope, max_slope);
    y_ = y;
  }

  static constexpr double max_slope = 1.2;  // 50 degrees: steeper is a wall, not a plate
  struct Gains {
    double level, slope;
  };
  static constexpr Gains steady_gains() { return gains[memory]; }

 private:
  static constexpr int memory = 12;  // 2.4 mm: short against a plate's curvature, long against its noise
  // By the number of points taken: two divisions less for every point of a frame.
  static constexpr std::array<Gains, memory + 1> gains = [] {
    std::array<Gains, memory + 1> table{};
    for (int n = 1; n <= memory; ++n) table[n] = {2.0 * (2 * n - 1) / (n * (n + 1.0)), 6.0 / (n * (n + 1.0))};
    return table;
  }();

  double y_ = 0, level_ = 0, slope_ = 0;
  int count_ = 0;
};

}  // namespace moldloft::geometry
