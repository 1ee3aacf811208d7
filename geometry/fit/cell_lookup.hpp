// Which cell of a knot vector a parameter lies in, for knots that are not equally spaced: a table of equal
// buckets leads to the first cell that may hold it.
//
// Cost         2-3 ns; buckets are as fine as the finest cell, up to 4,096
// Allocation   in the constructor only
#pragma once

#include <algorithm>
#include <cmath>
#include <span>
#include <vector>

#include "geometry/fit/spline_net.hpp"

namespace moldloft::geometry {

class CellLookup {
 public:
  explicit CellLookup(const SpanTable& table) {
    double finest = table[table.spans() - 1].end - table[0].begin;
    for (int k = 0; k < table.spans(); ++k) {
      begins_.push_back(table[k].begin);
      finest = std::min(finest, table[k].end - table[k].begin);
    }
    end_ = table[table.spans() - 1].end;
    const double length = end_ - begins_.front();
    const int buckets = static_cast<int>(std::clamp(std::ceil(length / finest), 1.0, 4096.0));
    scale_ = buckets / length;
    for (int b = 0, k = 0; b < buckets; ++b) {
      // A hair to the left, so that rounding cannot lead past the right cell.
      const double t = begins_.front() + (b - 1e-9) / scale_;
      while (k + 1 < table.spans() && begins_[k + 1] <= t) ++k;
      first_.push_back(k);
    }
  }
  bool holds(double t) const { return t >= begins_.front() && t <= end_; }
  // The cell and, in `local`, the place in it, 0..1. `t` must be held.
  int find(double t, double& local) const {
    const int bucket =
        std::min(static_cast<int>((t - begins_.front()) * scale_), static_cast<int>(first_.size()) - 1);
    int k = first_[bucket];
    const int last = static_cast<int>(begins_.size()) - 1;
    while (k < last && t >= begins_[k + 1]) ++k;
    local = (t - begins_[k]) / ((k < last ? begins_[k + 1] : end_) - begins_[k]);
    return k;
  }
  std::size_t bytes() const { return begins_.capacity() * sizeof(double) + first_.capacity() * sizeof(int); }

 private:
  std::vector<double> begins_;
  std::vector<int> first_;
  double end_ = 1, scale_ = 1;
};

}  // namespace moldloft::geometry
