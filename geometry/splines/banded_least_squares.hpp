// Least squares with a banded matrix, row by row: every equation is rotated into a triangle as it
// comes and can be forgotten. What curve fits and lofts are solved with; one equation an unknown
// makes it interpolation.
//
// Source       Givens rotations on the observation matrix (de Boor 1978, FITPACK's fpcurf); no normal
//              equations, so the condition number is not squared
// Accuracy     backward stable: the solution of equations that differ by 4 eps for every equation and unknown
//              of the band
// Cost         6 band (band + right sides) flops an equation; memory unknowns (band + right
//              sides), never equations
// Allocation   the constructor and solve()
// Failure      Error::singular from solve(): a pivot below unknowns * eps of the largest; pivots() says which
#pragma once

#include "geometry/error.hpp"

#include <Eigen/Core>

#include <expected>
#include <span>
#include <vector>

namespace moldloft::geometry {

// The diagonal of the triangle. smallest / largest is an upper bound on 1 / condition number.
struct Pivots {
  double smallest = 0, largest = 0;
  int weakest = 0;  // the unknown whose pivot is the smallest
  double ratio() const { return largest > 0 ? smallest / largest : 0; }
};

class BandedLeastSquares {
 public:
  // `band` is the most unknowns that one equation holds, side by side.
  BandedLeastSquares(int unknowns, int band, int right_sides);

  // The equation sum_i coefficients[i] x[first + i] = right, for all right sides at once.
  void add(int first, std::span<const double> coefficients, std::span<const double> right);

  Pivots pivots() const;
  std::expected<Eigen::MatrixXd, Error> solve() const;  // a row an unknown, a column a right side

  // What remains of the squared right sides after the fit, all of them summed.
  double residual_squares() const { return residual_squares_; }

 private:
  double* pivot_row(int unknown) { return triangle_.data() + static_cast<std::ptrdiff_t>(unknown) * width_; }
  const double* pivot_row(int unknown) const {
    return triangle_.data() + static_cast<std::ptrdiff_t>(unknown) * width_;
  }

  int unknowns_, band_, right_sides_, width_;
  std::vector<double> triangle_;  // a row an unknown: the diagonal and what follows it, then the right sides
  std::vector<double> row_;       // the equation that is being rotated in
  double residual_squares_ = 0;
};

}  // namespace moldloft::geometry
