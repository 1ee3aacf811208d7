#include "geometry/fit/moment_kernel.hpp"

#include "geometry/kernels.hpp"

#include <array>

namespace moldloft::geometry {

namespace {

// The halves' restriction matrices are dyadic numbers, hence exact:
//   B_p^n(t / 2) = sum over l >= p of C(l, p) 2^-l B_l^n(t), and mirrored for the second half.
constexpr double choose(int n, int k) {
  double c = 1;
  for (int i = 1; i <= k; ++i) c = c * (n - k + i) / i;
  return c;
}

template <int degree>
struct Halves {
  double rows[2][degree + 1][degree + 1] = {};             // [half][p][l]
  double columns[2][degree + 1][degree < 4 ? 4 : 8] = {};  // [half][l][p], rows filled up with zeros
  constexpr Halves() {
    for (int p = 0; p <= degree; ++p) {
      for (int l = p; l <= degree; ++l) {
        rows[0][p][l] = choose(l, p) / (1 << l);
        rows[1][degree - p][degree - l] = rows[0][p][l];
      }
    }
    for (int half = 0; half < 2; ++half) {
      for (int p = 0; p <= degree; ++p) {
        for (int l = 0; l <= degree; ++l) columns[half][l][p] = rows[half][p][l];
      }
    }
  }
};

constexpr Halves<6> halves6;
constexpr Halves<3> halves3;
constexpr auto& half6 = halves6.rows;
constexpr auto& half3 = halves3.rows;
constexpr auto& half6_columns = halves6.columns;
constexpr auto& half3_columns = halves3.columns;

}  // namespace

}  // namespace moldloft::geometry

#define MOLDLOFT_SIMD_KERNEL moment
#define MOLDLOFT_SIMD_FILE "geometry/fit/moment_kernel.inc"
#include "geometry/simd_variants.inc"

namespace moldloft::geometry {

#define MOLDLOFT_KERNEL(simd, name)                                                            \
  {                                                                                            \
    simd, name::locate, name::values, name::fold, name::fold_shot, name::heights, name::merge, \
        name::cell_gram                                                                        \
  }

namespace {
constexpr KernelVariants<MomentKernel> variants{{MOLDLOFT_EVERY_WIDTH(MOLDLOFT_KERNEL, moment)}};
}

const MomentKernel& moment_kernel(Simd simd) { return variants(simd); }

}  // namespace moldloft::geometry
