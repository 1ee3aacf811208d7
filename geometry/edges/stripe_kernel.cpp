#include "geometry/edges/stripe_kernel.hpp"

#include "geometry/kernels.hpp"

#define MOLDLOFT_SIMD_KERNEL stripe
#define MOLDLOFT_SIMD_FILE "geometry/edges/stripe_kernel.inc"
#include "geometry/simd_variants.inc"

namespace moldloft::geometry {

#define MOLDLOFT_KERNEL(simd, name) \
  { simd, name::go_on }

namespace {
constexpr KernelVariants<StripeKernel> variants{{MOLDLOFT_EVERY_WIDTH(MOLDLOFT_KERNEL, stripe)}};
}

const StripeKernel& stripe_kernel(Simd simd) { return variants(simd); }

}  // namespace moldloft::geometry
