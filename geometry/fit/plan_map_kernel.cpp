#include "geometry/fit/plan_map_kernel.hpp"

#include <cassert>

#define MOLDLOFT_SIMD_NAME portable_plan_map
#define MOLDLOFT_SIMD_LANES 2
#define MOLDLOFT_SIMD_TARGET
#include "geometry/fit/plan_map_kernel.inc"
#undef MOLDLOFT_SIMD_NAME
#undef MOLDLOFT_SIMD_LANES
#undef MOLDLOFT_SIMD_TARGET

#if defined(__x86_64__)
#define MOLDLOFT_SIMD_NAME avx2_plan_map
#define MOLDLOFT_SIMD_LANES 4
#define MOLDLOFT_SIMD_TARGET MOLDLOFT_TARGET_AVX2
#include "geometry/fit/plan_map_kernel.inc"
#undef MOLDLOFT_SIMD_NAME
#undef MOLDLOFT_SIMD_LANES
#undef MOLDLOFT_SIMD_TARGET

#define MOLDLOFT_SIMD_NAME avx512_plan_map
#define MOLDLOFT_SIMD_LANES 8
#define MOLDLOFT_SIMD_TARGET MOLDLOFT_TARGET_AVX512
#include "geometry/fit/plan_map_kernel.inc"
#endif

namespace moldloft::geometry {

const PlanMapKernel& plan_map_kernel(Simd simd) {
  assert(machine_has(simd));
  static constexpr PlanMapKernel portable{portable_plan_map::invert_eight};
#if defined(__x86_64__)
  static constexpr PlanMapKernel avx2{avx2_plan_map::invert_eight}, avx512{avx512_plan_map::invert_eight};
  if (simd == Simd::avx512) return avx512;
  if (simd == Simd::avx2) return avx2;
#endif
  (void)simd;
  return portable;
}

}  // namespace moldloft::geometry
