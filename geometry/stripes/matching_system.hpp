// The normal equations of bicubic B-spline control points under rows that each live on one cell of the net:
// band Cholesky (thesis eq. 3.42) with the factor kept, the outer ring unknown or given (eq. 3.40, 3.41).
//
// Shapes       a row is 16 numbers, basis function (i, j) of the cell's 4 x 4 at 4 i + j
// Cost         136 multiply-adds a row; size * half_band^2 to factor; 4 * size * half_band an axis to solve
// Allocation   in the constructor, and a right side in solve()
// Failure      singular: the control point that the rows leave free is named
#pragma once

#include "geometry/splines/band_cholesky.hpp"
#include "geometry/stripes/matching_failure.hpp"

#include <Eigen/Core>

#include <expected>

namespace moldloft::geometry {

struct PivotReport {
  double smallest = 1;  // pivot / diagonal: the share of a control point's weight that is its own
  NetIndex weakest;     // and the control point where that is
};

class MatchingSystem {
 public:
  // Below this (or more, after a small pivot) a pivot is rounding: the control point follows from the others,
  // not from the data.
  static constexpr double least_pivot = 1e-12;

  enum class Ring { unknown, given };

  MatchingSystem(int control_u, int control_v, Ring);

  // Adds the Gram matrix of a cell's rows; (first_u, first_v) is the first of the cell's 4 x
  // 4 control points.
  using Gram = Eigen::Matrix<double, 16, 16>;  // the blocks on and below the diagonal count, whole
  void add(int first_u, int first_v, const Gram&);

  std::expected<PivotReport, NetIndex> factor();

  // Adds a cell's rows times their data to the right side: 16 x 3, of size() x 3.
  using Side = Eigen::Matrix<double, 16, 3>;
  void add_side(int first_u, int first_v, const Side&, Eigen::MatrixX3d& side) const;
  void solve(Eigen::MatrixX3d& side) const;  // in place; factor() has succeeded

  // Of the factored matrix in the 2-norm: the square of the equations'. Its largest eigenvalue by the
  // largest row sum, its smallest by inverse iteration: between a half and eight times the truth. Costs
  // some ten solutions.
  double condition() const;
  int half_band() const { return band_.half_band(); }

  Ring ring() const { return skip_ == 1 ? Ring::given : Ring::unknown; }
  int size() const { return rows_ * columns_; }
  bool touches_ring(int first_u, int first_v) const;
  NetIndex control_of(int unknown) const { return {unknown / columns_ + skip_, unknown % columns_ + skip_}; }

 private:
  int skip_, rows_, columns_;  // unknowns run over [skip_, skip_ + rows_) x [skip_, skip_ + columns_)
  BandCholesky band_;
  double largest_row_sum_ = 0;
};

}  // namespace moldloft::geometry
