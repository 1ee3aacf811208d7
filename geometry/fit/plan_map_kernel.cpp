#include "geometry/fit/plan_map_kernel.hpp"

#include "geometry/kernels.hpp"

#define MOLDLOFT_SIMD_KERNEL plan_map
#define MOLDLOFT_SIMD_FILE "geometry/fit/plan_map_kernel.inc"
#include "geometry/simd_variants.inc"

namespace moldloft::geometry {

#define MOLDLOFT_KERNEL(simd, name) \
  { name::invert_eight }

namespace {
constexpr KernelVariants<PlanMapKernel> variants{{MOLDLOFT_EVERY_WIDTH(MOLDLOFT_KERNEL, plan_map)}};
}

const PlanMapKernel& plan_map_kernel(Simd simd) { return variants(simd); }

}  // namespace moldloft::geometry
