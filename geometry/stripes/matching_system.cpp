#include "geometry/stripes/matching_system.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>

namespace moldloft::geometry {

namespace {

constexpr int cell = 4;  // control points of a cell along one axis
constexpr double rounding = 256 * std::numeric_limits<double>::epsilon();  // of a pivot, by its diagonal

struct Range {
  int first, end;  // of the cell's four, those that are unknown
};
Range unknown_range(int offset, int count) { return {std::max(0, -offset), std::min(cell, count - offset)}; }

}  // namespace

MatchingSystem::MatchingSystem(int control_u, int control_v, Ring ring)
    : skip_(ring == Ring::given ? 1 : 0),
      rows_(control_u - 2 * skip_),
      columns_(control_v - 2 * skip_),
      band_(static_cast<std::size_t>(size()), static_cast<std::size_t>(3 * columns_ + 3)) {
  assert(control_u >= cell && control_v >= cell);
  band_.reset(size(), std::min(size() - 1, 3 * columns_ + 3));
  band_.clear(0, size());
}

bool MatchingSystem::touches_ring(int first_u, int first_v) const {
  if (skip_ == 0) return false;
  return first_u == 0 || first_v == 0 || first_u + cell > rows_ + 1 || first_v + cell > columns_ + 1;
}

void MatchingSystem::add(int first_u, int first_v, const Gram& gram) {
  const int u = first_u - skip_, v = first_v - skip_;
  const Range along_u = unknown_range(u, rows_), along_v = unknown_range(v, columns_);
  for (int i = along_u.first; i < along_u.end; ++i) {
    for (int j = along_v.first; j < along_v.end; ++j) {
      const int column = (u + i) * columns_ + v + j;
      for (int k = i; k < along_u.end; ++k) {
        const int first = k == i ? j : along_v.first;
        double* entries = &band_.entry((u + k) * columns_ + v + first, column);
        for (int l = first; l < along_v.end; ++l) entries[l - first] += gram(cell * k + l, cell * i + j);
      }
    }
  }
}

std::expected<PivotReport, NetIndex> MatchingSystem::factor() {
  Eigen::VectorXd diagonal(size()), row_sum = Eigen::VectorXd::Zero(size());
  for (int n = 0; n < size(); ++n) {
    row_sum[n] += band_.entry(n, n);
    for (int below = n + 1; below <= std::min(size() - 1, n + band_.half_band()); ++below) {
      const double entry = std::abs(band_.entry(below, n));
      row_sum[n] += entry, row_sum[below] += entry;
    }
    diagonal[n] = band_.entry(n, n);
    if (!(diagonal[n] > 0)) return std::unexpected(control_of(n));
  }
  largest_row_sum_ = row_sum.maxCoeff();
  const bool done = band_.factor(0, size());
  PivotReport report;
  for (int n = 0; n < size(); ++n) {
    // Where the factorization stopped, the pivot still stands on the diagonal, and it is not positive.
    const double root = band_.entry(n, n), pivot = root > 0 ? root * root / diagonal[n] : 0;
    // A small pivot before has magnified the rounding in this one as much as it has shrunk itself.
    const double least = std::max(least_pivot, rounding / report.smallest);
    if (!(pivot > least)) return std::unexpected(control_of(n));
    if (pivot < report.smallest) report = {pivot, control_of(n)};
  }
  if (!done) return std::unexpected(control_of(size() - 1));
  return report;
}

void MatchingSystem::add_side(int first_u, int first_v, const Side& part, Eigen::MatrixX3d& side) const {
  const int u = first_u - skip_, v = first_v - skip_;
  const Range along_u = unknown_range(u, rows_), along_v = unknown_range(v, columns_);
  for (int axis = 0; axis < 3; ++axis)
    for (int i = along_u.first; i < along_u.end; ++i)
      for (int j = along_v.first; j < along_v.end; ++j)
        side((u + i) * columns_ + v + j, axis) += part(cell * i + j, axis);
}

void MatchingSystem::solve(Eigen::MatrixX3d& side) const {
  for (int axis = 0; axis < 3; ++axis) {
    const std::span<double> column(side.col(axis).data(), static_cast<std::size_t>(size()));
    band_.solve_lower(column, 0, size());
    band_.solve_upper(column, 0, size());
  }
}

double MatchingSystem::condition() const {
  constexpr int steps = 10;
  Eigen::VectorXd x(size());
  for (int n = 0; n < size(); ++n)
    x[n] = std::cos(1.0 + 2.0 * n);  // no eigenvector is orthogonal to it by design
  double inverse = 0;
  for (int step = 0; step < steps; ++step) {
    x.normalize();
    const std::span<double> column(x.data(), static_cast<std::size_t>(size()));
    band_.solve_lower(column, 0, size());
    band_.solve_upper(column, 0, size());
    inverse = x.norm();
  }
  return largest_row_sum_ * inverse;
}

}  // namespace moldloft::geometry
