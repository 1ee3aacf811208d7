#include "geometry/splines/banded_least_squares.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>

namespace moldloft::geometry {

BandedLeastSquares::BandedLeastSquares(int unknowns, int band, int right_sides)
    : unknowns_(unknowns),
      band_(band),
      right_sides_(right_sides),
      width_(band + right_sides),
      triangle_(static_cast<std::size_t>(unknowns) * width_),
      row_(static_cast<std::size_t>(width_)) {}

void BandedLeastSquares::add(int first, std::span<const double> coefficients, std::span<const double> right) {
  [[maybe_unused]] const int count = static_cast<int>(coefficients.size());  // for the assertion alone
  assert(count <= band_ && first >= 0 && first + count <= unknowns_);
  assert(static_cast<int>(right.size()) == right_sides_);
  std::fill(std::copy(coefficients.begin(), coefficients.end(), row_.begin()), row_.begin() + band_, 0.0);
  std::copy(right.begin(), right.end(), row_.begin() + band_);

  // Every rotation turns the row's leading entry into the pivot of that unknown; then the row moves on by
  // one. The fill behind `count` never leaves the band, since pivot rows end where the band does.
  for (int unknown = first; unknown < unknowns_; ++unknown) {
    double* pivot = pivot_row(unknown);
    if (row_[0] != 0) {
      const double length = std::hypot(pivot[0], row_[0]);
      const double cosine = pivot[0] / length, sine = row_[0] / length;
      pivot[0] = length;
      for (int i = 1; i < width_; ++i) {
        const double old = pivot[i];
        pivot[i] = cosine * old + sine * row_[i];
        row_[i] = cosine * row_[i] - sine * old;
      }
    }
    std::shift_left(row_.begin(), row_.begin() + band_, 1);
    row_[band_ - 1] = 0;
    if (std::all_of(row_.begin(), row_.begin() + band_, [](double a) { return a == 0; })) break;
  }
  for (int i = band_; i < width_; ++i) residual_squares_ += row_[i] * row_[i];
}

Pivots BandedLeastSquares::pivots() const {
  Pivots found{std::numeric_limits<double>::infinity(), 0, 0};
  for (int unknown = 0; unknown < unknowns_; ++unknown) {
    const double pivot = pivot_row(unknown)[0];
    if (!(pivot >= found.smallest)) found.smallest = pivot, found.weakest = unknown;
    found.largest = std::max(found.largest, pivot);
  }
  return found;
}

std::expected<Eigen::MatrixXd, Error> BandedLeastSquares::solve() const {
  Eigen::MatrixXd x(unknowns_, right_sides_);
  const Pivots found = pivots();
  if (unknowns_ > 0 && !(found.ratio() > unknowns_ * std::numeric_limits<double>::epsilon()))
    return std::unexpected(Error::singular);
  for (int unknown = unknowns_; unknown-- > 0;) {
    const double* pivot = pivot_row(unknown);
    for (int side = 0; side < right_sides_; ++side) {
      double sum = pivot[band_ + side];
      for (int i = 1; i < band_ && unknown + i < unknowns_; ++i) sum -= pivot[i] * x(unknown + i, side);
      x(unknown, side) = sum / pivot[0];
    }
  }
  return x;
}

}  // namespace moldloft::geometry
