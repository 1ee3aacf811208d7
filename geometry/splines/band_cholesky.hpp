// Cholesky factorization of a symmetric positive definite band matrix, and its triangular solves, in slices
// of columns: the work of a control tick is bounded, the numbers are those of one go.
//
// Storage      the lower band, column by column: entry(i, j) for j <= i <= j + half_band
// Cost         half_band^2 a column to factor, 2 half_band a column and right-hand side to solve
// Allocation   in the constructor only; reset() takes any smaller size
// Failure      factor() returns false at a pivot that is not positive
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <span>
#include <vector>

namespace moldloft::geometry {

class BandCholesky {
 public:
  BandCholesky(std::size_t max_size, std::size_t max_half_band);

  void reset(int size, int half_band);  // sizes only; clear() the columns before adding to them
  void clear(int first_column, int end_column);
  int size() const { return size_; }
  int half_band() const { return half_band_; }

  double& entry(int i, int j) { return band_[static_cast<std::size_t>(j) * stride_ + (i - j)]; }

  // Factors columns [first, end); all before them must be done.
  bool factor(int first, int end);
  double smallest_pivot() const { return smallest_; }
  double largest_pivot() const { return largest_; }

  // One slice of L y = b, columns [first, end) in ascending order, and of L' x = y, in descending order; in
  // place.
  void solve_lower(std::span<double> x, int first, int end) const;
  void solve_upper(std::span<double> x, int first, int end) const;

  std::size_t bytes() const { return band_.capacity() * sizeof(double); }

 private:
  int reach(int column) const { return std::min(half_band_, size_ - 1 - column); }

  std::vector<double> band_;
  int size_ = 0, half_band_ = 0, stride_ = 1;
  double smallest_ = 0, largest_ = 0;
};

}  // namespace moldloft::geometry
