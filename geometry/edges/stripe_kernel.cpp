#include "geometry/edges/stripe_kernel.hpp"

#include <cassert>

#define MOLDLOFT_SIMD_NAME portable_stripe
#define MOLDLOFT_SIMD_LANES 2
#define MOLDLOFT_SIMD_TARGET
#include "geometry/edges/stripe_kernel.inc"
#undef MOLDLOFT_SIMD_NAME
#undef MOLDLOFT_SIMD_LANES
#undef MOLDLOFT_SIMD_TARGET

#if defined(__x86_64__)
#define MOLDLOFT_SIMD_NAME avx2_stripe
#define MOLDLOFT_SIMD_LANES 4
#define MOLDLOFT_SIMD_TARGET MOLDLOFT_TARGET_AVX2
#include "geometry/edges/stripe_kernel.inc"
#undef MOLDLOFT_SIMD_NAME
#undef MOLDLOFT_SIMD_LANES
#undef MOLDLOFT_SIMD_TARGET

#define MOLDLOFT_SIMD_NAME avx512_stripe
#define MOLDLOFT_SIMD_LANES 8
#define MOLDLOFT_SIMD_TARGET MOLDLOFT_TARGET_AVX512
#include "geometry/edges/stripe_kernel.inc"
#endif

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
