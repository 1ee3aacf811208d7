// What the fit is measured against, compiled for this machine alone (-O3 -march=native) in a shared library
// of its own, whose Eigen is not ours: inlines compiled for other instructions must not meet.
#pragma once

#include <cstddef>

namespace moldloft::bench::native {

#define MOLDLOFT_NATIVE extern "C" [[gnu::visibility("default")]]

// Adds up all numbers of three columns: what reading them costs.
MOLDLOFT_NATIVE double moldloft_read_floor(const double* u, const double* v, const double* z,
                                           std::size_t points);

// Span, 4 + 4 cubic basis values and their 16 products of every point, eight points a step: what any fit
// that looks at its points must do at least.
MOLDLOFT_NATIVE double moldloft_basis_floor(const double* u, const double* v, std::size_t points, int spans);

// Least squares on a uniform clamped control x control net as one would write it with Eigen: the
// sparse matrix of basis values row by row, its normal equations, simplicial Cholesky with AMD
// ordering. u and v in [0, 1]; `control_points` has room for control * control numbers, v running
// fastest. False if the factorization fails.
MOLDLOFT_NATIVE bool moldloft_plain_eigen_fit(const double* u, const double* v, const double* z,
                                              std::size_t points, int control, double* control_points);

}  // namespace moldloft::bench::native
