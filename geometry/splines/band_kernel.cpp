#include "geometry/splines/band_kernel.hpp"

#include "geometry/kernels.hpp"

#include <cfloat>

#define MOLDLOFT_SIMD_KERNEL band
#define MOLDLOFT_SIMD_FILE "geometry/splines/band_kernel.inc"
#include "geometry/simd_variants.inc"

namespace moldloft::geometry {

#define MOLDLOFT_KERNEL(simd, name) \
  { simd, name::factor_panel, name::solve_lower, name::solve_upper, name::solve_lower_many, name::gram_block }

namespace {
constexpr KernelVariants<BandKernel> variants{{MOLDLOFT_EVERY_WIDTH(MOLDLOFT_KERNEL, band)}};
}

const BandKernel& band_kernel(Simd simd) { return variants(simd); }

}  // namespace moldloft::geometry
