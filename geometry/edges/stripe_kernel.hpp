// The inner loop of the walk along stripes, in every variant of simd.hpp: eight stripes a point further at a time,
// as long as every one of them simply goes on or misses a point. A point waits for the result of the one before it (a
// division and a dozen dependent operations); eight stripes wait together.
//
// Source       StripeWalk::step() for a filter whose memory is full: the same operations in the same order, so
//              the same bits
// Units        mm
// Cost         2 ns a point where nothing stops the eight
// Allocation   none
#pragma once

#include "geometry/simd.hpp"

#include <cstdint>

namespace moldloft::geometry {

struct StripeLanes {
  static constexpr int count = 8;
  const float *x[count], *y[count], *z[count];  // of the next point
  alignas(64) double y_before[count], level[count], slope[count];
  alignas(64) double spacing[count], noise[count], bridge[count];
};

// What a point that goes on keeps to, and how the line follows it.
struct SmoothLine {
  double slope_doubt, half_curvature, level_gain, slope_gain, max_slope;
};

struct StripeKernel {
  Simd simd;
  // Goes at most `points` points further on every lane, and stops before one that a lane cannot go on with: then its
  // bit is set in `stopped`. Says how many it went; a lane's bit in taken[i] says that its i-th was there, not a
  // missing one. The line's state follows, the pointers do not.
  int (*go_on)(StripeLanes&, const SmoothLine&, int points, std::uint8_t* taken, unsigned& stopped);
};

// The variant asked for; it must be one that machine_has().
const StripeKernel& stripe_kernel(Simd = widest_simd());

}  // namespace moldloft::geometry
