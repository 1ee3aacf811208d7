#include "geometry/splines/band_kernel.hpp"

#include <cassert>
#include <cfloat>

#define MOLDLOFT_SIMD_KERNEL band
#define MOLDLOFT_SIMD_FILE "geometry/splines/band_kernel.inc"
#include "geometry/simd_variants.inc"

namespace moldloft::geometry {

#define MOLDLOFT_KERNEL(simd, name) \
  { simd, name::factor_panel, name::solve_lower, name::solve_upper, name::solve_lower_many, name::gram_block }

const BandKernel& band_kernel(Simd simd) {
  assert(machine_has(simd));
  static constexpr BandKernel portable = MOLDLOFT_KERNEL(Simd::portable, portable_band);
#if defined(__x86_64__)
  static constexpr BandKernel avx2 = MOLDLOFT_KERNEL(Simd::avx2, avx2_band);
  static constexpr BandKernel avx512 = MOLDLOFT_KERNEL(Simd::avx512, avx512_band);
  if (simd == Simd::avx512) return avx512;
  if (simd == Simd::avx2) return avx2;
#endif
  (void)simd;
  return portable;
}

}  // namespace moldloft::geometry
