// The cells between the distinct knots of one direction, and which of them a parameter lies in: a table of equal
// buckets leads to the first cell that may hold it, so that nothing is searched.
//
// Units        the knots' parameter
// Cost         locate() 2-3 ns; built in O(cells + buckets)
// Memory       buckets are as fine as the finest cell, 4,096 at most
// Allocation   in the constructor only
// Expects      knots that pass check_knots() for a cubic (or `degree`)
#pragma once

#include "geometry/splines/knots.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <span>
#include <vector>

namespace moldloft::geometry {

class KnotCells {
 public:
  KnotCells() = default;
  explicit KnotCells(std::span<const double> knots, int degree = cubic) {
    const std::size_t end = knots.size() - static_cast<std::size_t>(degree);
    for (std::size_t k = static_cast<std::size_t>(degree); k < end; ++k) {
      if (breaks_.empty() || knots[k] > breaks_.back()) breaks_.push_back(knots[k]);
    }
    double finest = last() - first();
    for (int cell = 0; cell < count(); ++cell) finest = std::min(finest, end_of(cell) - begin_of(cell));
    const int buckets = static_cast<int>(std::clamp(std::ceil((last() - first()) / finest), 1.0, 4096.0));
    per_unit_ = buckets / (last() - first());
    start_.resize(static_cast<std::size_t>(buckets) + 1);  // one more for the very end
    int cell = 0;
    for (int bucket = 0; bucket <= buckets; ++bucket) {
      // A hair less, so that rounding in locate() can only make the walk start too early.
      const double begin = first() + (bucket - 1e-9) / per_unit_;
      while (begin >= end_of(cell) && cell + 1 < count()) ++cell;
      start_[static_cast<std::size_t>(bucket)] = cell;
    }
  }

  int count() const { return static_cast<int>(breaks_.size()) - 1; }
  double first() const { return breaks_.front(); }
  double last() const { return breaks_.back(); }
  double begin_of(int cell) const { return breaks_[static_cast<std::size_t>(cell)]; }
  double end_of(int cell) const { return breaks_[static_cast<std::size_t>(cell) + 1]; }

  bool holds(double t) const { return t >= first() && t <= last(); }
  int locate(double t) const {  // t must be held
    int cell = start_[static_cast<std::size_t>((t - first()) * per_unit_)];
    while (t >= end_of(cell) && cell + 1 < count()) ++cell;
    return cell;
  }
  // The place in the cell, 0..1.
  double local(int cell, double t) const { return (t - begin_of(cell)) / (end_of(cell) - begin_of(cell)); }

  std::size_t bytes() const { return breaks_.capacity() * sizeof(double) + start_.capacity() * sizeof(int); }

 private:
  std::vector<double> breaks_;
  std::vector<int> start_;  // of every bucket: the first cell that may hold its parameters
  double per_unit_ = 0;
};

}  // namespace moldloft::geometry
