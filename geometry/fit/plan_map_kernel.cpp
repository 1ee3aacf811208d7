#include "geometry/fit/plan_map_kernel.hpp"

#include <cassert>

#define MOLDLOFT_SIMD_KERNEL plan_map
#define MOLDLOFT_SIMD_FILE "geometry/fit/plan_map_kernel.inc"
#include "geometry/simd_variants.inc"

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
