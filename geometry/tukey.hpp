// Tukey's biweight: what a residual counts where some of the data may be wrong.
//
// Source       Beaton and Tukey 1974
// Cost         a few operations; allocates nothing
#pragma once

namespace moldloft::geometry {

constexpr double tukey_cutoff = 4.685;  // in scales; 95 % efficiency on Gaussian noise

// 1 in the middle, 0 from tukey_cutoff scales on.
inline double tukey_weight(double residual, double scale) {
  const double x = residual / (tukey_cutoff * scale), left = 1 - x * x;
  return left > 0 ? left * left : 0;
}

}  // namespace moldloft::geometry
