// Which vector instructions a kernel may use: one binary carries every variant, and the machine picks
// at run time.
//
// A kernel is written once, in a .inc file, on the compiler's vector extension, and included once a variant by
// simd_variants.inc, which sets
//     MOLDLOFT_SIMD_LANES   doubles in a vector: 2, 4, 8
//     MOLDLOFT_SIMD_TARGET  the attribute that every function of the file carries
//     MOLDLOFT_SIMD_NAME    the namespace it lands in
// The rule that makes all variants give the same bits: no fused multiply-add (the build's
// -ffp-contract=off), and every number is the result of the same operations in the same order whatever the
// width. Sums go over points in order, lanes over entries; a sum over lanes is kept in eight partial sums
// that are added up in one fixed order.
#pragma once

#include <array>
#include <span>
#include <string_view>

namespace moldloft::geometry {

enum class Simd { portable, avx2, avx512 };

inline std::string_view to_string(Simd simd) {
  return simd == Simd::avx512 ? "avx512" : simd == Simd::avx2 ? "avx2" : "portable";
}

inline bool machine_has(Simd simd) {
#if defined(__x86_64__)
  if (simd == Simd::avx2) return __builtin_cpu_supports("avx2");
  if (simd == Simd::avx512) {
    return __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") &&
           __builtin_cpu_supports("avx512vl");
  }
#endif
  return simd == Simd::portable;
}

// Asked once, before main(): a local static takes a lock when it is first used.
inline const Simd widest_of_this_machine = machine_has(Simd::avx512) ? Simd::avx512
                                           : machine_has(Simd::avx2) ? Simd::avx2
                                                                     : Simd::portable;
inline Simd widest_simd() { return widest_of_this_machine; }

}  // namespace moldloft::geometry

#if defined(__x86_64__)
#define MOLDLOFT_TARGET_AVX2 [[gnu::target("avx2")]]
#define MOLDLOFT_TARGET_AVX512 [[gnu::target("avx512f,avx512dq,avx512vl")]]
#endif

#define MOLDLOFT_PRAGMA(words) _Pragma(#words)
#if defined(__clang__)
#define MOLDLOFT_UNROLL MOLDLOFT_PRAGMA(clang loop unroll(full))
#define MOLDLOFT_ROLLED MOLDLOFT_PRAGMA(clang loop unroll(disable))
#else
#define MOLDLOFT_UNROLL MOLDLOFT_PRAGMA(GCC unroll 16)
#define MOLDLOFT_ROLLED MOLDLOFT_PRAGMA(GCC unroll 1)
#endif
