#include "geometry/splines/band_cholesky.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>

namespace moldloft::geometry {

namespace {

using Column = Eigen::Map<Eigen::VectorXd>;
using ConstColumn = Eigen::Map<const Eigen::VectorXd>;

}  // namespace

BandCholesky::BandCholesky(std::size_t max_size, std::size_t max_half_band)
    : band_(max_size * (max_half_band + 1)) {}

void BandCholesky::reset(int size, int half_band) {
  assert(static_cast<std::size_t>(size) * (half_band + 1) <= band_.size());
  size_ = size, half_band_ = half_band, stride_ = half_band + 1;
  smallest_ = std::numeric_limits<double>::infinity(), largest_ = 0;
}

void BandCholesky::clear(int first_column, int end_column) {
  std::fill(band_.begin() + static_cast<std::size_t>(first_column) * stride_,
            band_.begin() + static_cast<std::size_t>(end_column) * stride_, 0.0);
}

bool BandCholesky::factor(int first, int end) {
  for (int j = first; j < end; ++j) {
    double* column = &band_[static_cast<std::size_t>(j) * stride_];
    const double pivot = column[0];
    if (!(pivot > 0) || !std::isfinite(pivot)) return false;
    smallest_ = std::min(smallest_, pivot), largest_ = std::max(largest_, pivot);
    const int n = reach(j);
    const double root = std::sqrt(pivot);
    column[0] = root;
    Column(column + 1, n) /= root;
    for (int k = 1; k <= n; ++k) {
      if (column[k] == 0) continue;
      Column(&band_[static_cast<std::size_t>(j + k) * stride_], n - k + 1) -=
          column[k] * ConstColumn(column + k, n - k + 1);
    }
  }
  return true;
}

void BandCholesky::solve_lower(std::span<double> x, int first, int end) const {
  for (int j = first; j < end; ++j) {
    const double* column = &band_[static_cast<std::size_t>(j) * stride_];
    x[j] /= column[0];
    const int n = reach(j);
    Column(x.data() + j + 1, n) -= x[j] * ConstColumn(column + 1, n);
  }
}

void BandCholesky::solve_upper(std::span<double> x, int first, int end) const {
  for (int j = end; j-- > first;) {
    const double* column = &band_[static_cast<std::size_t>(j) * stride_];
    const int n = reach(j);
    x[j] = (x[j] - ConstColumn(column + 1, n).dot(ConstColumn(x.data() + j + 1, n))) / column[0];
  }
}

}  // namespace moldloft::geometry
