#include "geometry/edges/stripe_kernel.hpp"

#include <cassert>

#define MOLDLOFT_SIMD_KERNEL stripe
#define MOLDLOFT_SIMD_FILE "geometry/edges/stripe_kernel.inc"
#include "geometry/simd_variants.inc"

namespace moldloft::geometry {

const StripeKernel& stripe_kernel(Simd simd) {
  assert(machine_has(simd));
  static constexpr StripeKernel portable{Simd::portable, portable_stripe::go_on};
#if defined(__x86_64__)
  static constexpr StripeKernel avx2{Simd::avx2, avx2_stripe::go_on};
  static constexpr StripeKernel avx512{Simd::avx512, avx512_stripe::go_on};
  if (simd == Simd::avx512) return avx512;
  if (simd == Simd::avx2) return avx2;
#endif
  (void)simd;
  return portable;
}

}  // namespace moldloft::geometry
