// The inner loops of the band Cholesky factorization and of its triangular solves, in every
// variant of simd.hpp.
//
// Source       right-looking, in panels of eight columns: a trailing entry meets the panel's columns in
//              ascending order, as it would one column at a time, so that panels, slices and vector widths
//              all give the same bits
// Storage      entry (i, j), j <= i <= j + half_band, at a[j * ld + i]: a band is a dense matrix whose
//              columns overlap. ld is a multiple of 8 and at least half_band + 17: whole vectors may
//              touch what lies between the columns: right below a column it must be zero and stays so,
//              the rest never matters
// Allocation   none
#pragma once

#include "geometry/simd.hpp"

#include <cstddef>

namespace moldloft::geometry {

constexpr int band_panel = 8;

struct BandMatrix {
  double* a;  // 64-byte aligned
  std::ptrdiff_t ld;
  int size, half_band;
};

struct BandPivots {
  double smallest = 0, largest = 0;  // of the diagonal before the root is taken
  int smallest_column = 0, failed_column = -1;
};

struct BandKernel {
  Simd simd;
  // Factors columns [first, first + columns), columns <= band_panel, and takes them off all later ones.
  // `pack` has room for 16 (half_band + 24) numbers. False at a pivot that is not positive.
  bool (*factor_panel)(const BandMatrix&, int first, int columns, double* pack, BandPivots&);
  void (*solve_lower)(const BandMatrix&, double* x, int first, int end);
  void (*solve_upper)(const BandMatrix&, double* x, int first, int end);
  // Many right-hand sides side by side: x[row * row_length + side]; `first_side` and `sides` are
  // multiples of 8.
  void (*solve_lower_many)(const BandMatrix&, double* x, int row_length, int first_side, int sides, int first,
                           int end);
  // out[8 * i + k] += sum of x[row][a + i] x[row][b + k] over the rows [first_row, end_row).
  void (*gram_block)(const double* x, int row_length, int first_row, int end_row, int a, int b, double* out);
};

// The variant asked for; it must be one that machine_has().
const BandKernel& band_kernel(Simd = widest_simd());

}  // namespace moldloft::geometry
