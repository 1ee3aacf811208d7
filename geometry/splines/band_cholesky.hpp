// Cholesky factorization of a symmetric positive definite band matrix, and its triangular solves, in
// slices of columns: the work of a control tick is bounded, the numbers are those of one go, bit for bit,
// on any vector unit.
//
// Storage      the lower band, column by column: entry(i, j) for j <= i <= j + half_band
// Accuracy     that of Cholesky without pivoting: |L L' - A| <= (half_band + 2) eps |L| |L'| entry by entry
// Cost         half_band^2 / 2 multiply-adds a column to factor, 2 half_band a column and right-hand side
//              to solve; 4,096 columns of half band 201 in 3 ms, 529 of 72 in 0.1 ms (AVX-512)
// Memory       what the sizes at hand do not need is not touched
// Allocation   in the constructor only; reset() takes any smaller size
// Failure      factor() returns false at a pivot that is not positive, and failed_column() says where
#pragma once

#include "geometry/splines/band_kernel.hpp"
#include "geometry/unwritten.hpp"

#include <Eigen/Core>

#include <cstddef>
#include <span>
#include <vector>

namespace moldloft::geometry {

class BandCholesky {
 public:
  BandCholesky(std::size_t max_size, std::size_t max_half_band, Simd = widest_simd());

  bool holds(std::size_t size, std::size_t half_band) const;
  void reset(int size, int half_band);  // sizes only; clear() the columns before adding to them
  void clear(int first_column, int end_column);
  int size() const { return size_; }
  int half_band() const { return half_band_; }

  double& entry(int i, int j) { return start_[j * ld_ + i]; }
  double entry(int i, int j) const { return start_[j * ld_ + i]; }

  // Factors columns [first, end); all before them must be done.
  bool factor(int first, int end);
  double smallest_pivot() const { return pivots_.smallest; }
  double largest_pivot() const { return pivots_.largest; }
  int smallest_column() const { return pivots_.smallest_column; }
  int failed_column() const { return pivots_.failed_column; }  // -1: none

  // One slice of L y = b, columns [first, end) in ascending order, and of L' x = y, in descending
  // order; in place.
  void solve_lower(std::span<double> x, int first, int end) const;
  void solve_upper(std::span<double> x, int first, int end) const;

  // The same slice of L Y = B for many right-hand sides, row by row: x[row * row_length + side], for the
  // sides [first_side, first_side + sides), both multiples of 8.
  void solve_lower_many(std::span<double> x, int row_length, int first_side, int sides, int first,
                        int end) const;

  const BandKernel& kernel() const { return *kernel_; }
  std::size_t bytes() const { return (band_.capacity() + pack_.capacity()) * sizeof(double); }

 private:
  BandMatrix matrix() const { return {start_, ld_, size_, half_band_}; }

  const BandKernel* kernel_;
  std::vector<double, Unwritten<Eigen::aligned_allocator<double>>> band_;
  std::vector<double, Eigen::aligned_allocator<double>> pack_;
  double* start_ = nullptr;
  std::ptrdiff_t ld_ = 8;
  int size_ = 0, half_band_ = 0;
  BandPivots pivots_;
};

}  // namespace moldloft::geometry
