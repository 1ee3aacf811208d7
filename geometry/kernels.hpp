// The variants of a kernel, one for every vector width that the program was built with (simd.hpp), and the choice among
// them: written once for all kernels. A kernel's .cpp includes simd_variants.inc and then says
//
//     #define MOLDLOFT_KERNEL(simd, name) {simd, name::locate, name::fold}
//     constexpr KernelVariants<MomentKernel> variants{{MOLDLOFT_EVERY_WIDTH(MOLDLOFT_KERNEL, moment)}};
//
// Threads      any
// Allocation   none
#pragma once

#include "geometry/simd.hpp"

#include <cassert>
#include <cstddef>

namespace moldloft::geometry {

#if defined(__x86_64__)
inline constexpr std::size_t vector_widths = 3;
#define MOLDLOFT_EVERY_WIDTH(entry, kernel)                                   \
  entry(Simd::portable, portable_##kernel), entry(Simd::avx2, avx2_##kernel), \
      entry(Simd::avx512, avx512_##kernel)
#else
inline constexpr std::size_t vector_widths = 1;
#define MOLDLOFT_EVERY_WIDTH(entry, kernel) entry(Simd::portable, portable_##kernel)
#endif

template <typename Kernel>
struct KernelVariants {
  Kernel of_width[vector_widths];  // in the order of Simd

  const Kernel& operator()(Simd simd) const {  // that the machine has
    assert(machine_has(simd));
    return of_width[static_cast<std::size_t>(simd)];
  }
};

}  // namespace moldloft::geometry
