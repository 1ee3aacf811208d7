#include "geometry/splines/band_cholesky.hpp"

#include <algorithm>
#include <cassert>
#include <limits>

namespace moldloft::geometry {

namespace {

// Before the first column and behind the last: whole vectors may begin above the diagonal and end below the band.
constexpr std::size_t lead = 16, tail = 16;

std::size_t leading_dimension(std::size_t half_band) { return (half_band + 17 + 7) / 8 * 8; }

std::size_t storage(std::size_t size, std::size_t half_band) {
  return lead + size * (leading_dimension(half_band) + 1) + tail;
}

}  // namespace

BandCholesky::BandCholesky(std::size_t max_size, std::size_t max_half_band, Simd simd)
    : kernel_(&band_kernel(simd)), band_(storage(max_size, max_half_band)), pack_(16 * (max_half_band + 24)) {
  // Aligned so that rows whose number is a multiple of 8 begin a cache line.
  start_ = band_.data() + lead;
}

bool BandCholesky::holds(std::size_t size, std::size_t half_band) const {
  return storage(size, half_band) <= band_.size() && 16 * (half_band + 24) <= pack_.size();
}

void BandCholesky::reset(int size, int half_band) {
  assert(holds(static_cast<std::size_t>(size), static_cast<std::size_t>(half_band)));
  size_ = size, half_band_ = half_band;
  ld_ = static_cast<std::ptrdiff_t>(leading_dimension(half_band));
  std::fill_n(band_.data(), lead, 0.0);
  std::fill_n(start_ + size * (ld_ + 1), tail, 0.0);
  pivots_ = {.smallest = std::numeric_limits<double>::infinity()};
}

void BandCholesky::clear(int first_column, int end_column) {
  std::fill(start_ + first_column * (ld_ + 1), start_ + end_column * (ld_ + 1), 0.0);
}

bool BandCholesky::factor(int first, int end) {
  for (int j = first; j < end; j += band_panel) {
    if (!kernel_->factor_panel(matrix(), j, std::min(end - j, band_panel), pack_.data(), pivots_))
      return false;
  }
  return true;
}

void BandCholesky::solve_lower(std::span<double> x, int first, int end) const {
  kernel_->solve_lower(matrix(), x.data(), first, end);
}

void BandCholesky::solve_upper(std::span<double> x, int first, int end) const {
  kernel_->solve_upper(matrix(), x.data(), first, end);
}

void BandCholesky::solve_lower_many(std::span<double> x, int row_length, int first_side, int sides, int first,
                                    int end) const {
  assert(first_side % 8 == 0 && sides % 8 == 0 && first_side + sides <= row_length);
  kernel_->solve_lower_many(matrix(), x.data(), row_length, first_side, sides, first, end);
}

}  // namespace moldloft::geometry
