// The inner loop of the plan map's inverse: Newton's method on eight points at once that lie in one span of
// the sides in either direction, as the points of a stripe nearly always do.
//
// Accuracy     all eight take one more step after the last has come within the tolerance
// Cost         10 ns a point and step with SSE2, 3 with AVX-512
#pragma once

#include "geometry/simd.hpp"

namespace moldloft::geometry {

struct PlanSpan {
  const double (*along_u)[4];  // [low x, low y, high x, high y][power], in the span's own coordinate
  const double (*along_v)[4];
  double spans, first_u, first_v;  // of a side; number of this one
  double corner[4][2];             // (0, 0), (1, 0), (0, 1), (1, 1)
  double tolerance;
  int most_steps;
};

struct PlanMapKernel {
  // From guesses in u and v to parameters. False when not all eight came within the tolerance.
  bool (*invert_eight)(const PlanSpan&, const double* x, const double* y, double* u, double* v);
};

const PlanMapKernel& plan_map_kernel(Simd = widest_simd());

}  // namespace moldloft::geometry
