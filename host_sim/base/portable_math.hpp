// Logarithm, sine and cosine from additions, multiplications and divisions alone. The C library picks
// variants by processor and version, and they differ in the last bit. These do not, so that a seed means the
// same noise and the same plate on every machine.
//
// Accuracy     4 eps relative for the logarithm; 2 eps absolute for sine and cosine, |x| <= 1e5
// Cost         5 to 10 ns
#pragma once

#include <cmath>

namespace moldloft::host_sim {

// Divisions would cost more than everything else, so the series' quotients stand here as numbers.
inline constexpr double odd_reciprocals[] = {1.0,      1.0 / 3,  1.0 / 5,  1.0 / 7,  1.0 / 9, 1.0 / 11,
                                             1.0 / 13, 1.0 / 15, 1.0 / 17, 1.0 / 19, 1.0 / 21};
inline constexpr double sine_ratios[] = {-1.0 / 6,   -1.0 / 20,  -1.0 / 42,  -1.0 / 72,
                                         -1.0 / 110, -1.0 / 156, -1.0 / 210, -1.0 / 272};
inline constexpr double cosine_ratios[] = {-1.0 / 2,   -1.0 / 12,  -1.0 / 30,  -1.0 / 56, -1.0 / 90,
                                           -1.0 / 132, -1.0 / 182, -1.0 / 240, -1.0 / 306};

// Natural logarithm of a positive, finite, normal number.
inline double portable_log(double x) noexcept {
  constexpr double ln2 = 0.69314718055994530942;
  int exponent = 0;
  double mantissa = std::frexp(x, &exponent);  // exact
  if (mantissa < 0.70710678118654752440) {
    mantissa *= 2.0;
    --exponent;
  }
  // log(m) = 2 artanh(s), s = (m - 1) / (m + 1), |s| <= 0.172: eleven terms of the odd series reach 1e-17.
  const double s = (mantissa - 1.0) / (mantissa + 1.0), s2 = s * s;
  double series = 0.0;
  for (int k = 10; k >= 0; --k) series = series * s2 + odd_reciprocals[k];
  return exponent * ln2 + 2.0 * s * series;
}

struct SineCosine {
  double sine, cosine;
};

inline SineCosine portable_sin_cos(double x) noexcept {
  constexpr double two_over_pi = 0.63661977236758134308;
  // pi/2 in two parts (Cody and Waite): the first has 33 bits, so that k times it is exact for |k| < 2^20.
  constexpr double half_pi_high = 1.57079632673412561417e+00, half_pi_low = 6.07710050650619224932e-11;
  const double quarters = std::nearbyint(x * two_over_pi);
  const double r = (x - quarters * half_pi_high) - quarters * half_pi_low, r2 = r * r;
  // Taylor by Horner, sin r = r (1 - r2/6 (1 - r2/20 (...))); |r| <= pi/4: the first term left out is below 1e-17.
  double s = 0.0, c = 0.0;
  for (int k = 7; k >= 0; --k) s = (1.0 + s) * r2 * sine_ratios[k];
  for (int k = 8; k >= 0; --k) c = (1.0 + c) * r2 * cosine_ratios[k];
  const double sine = r + r * s, cosine = 1.0 + c;
  switch (static_cast<long long>(quarters) & 3) {
    case 0:
      return {sine, cosine};
    case 1:
      return {cosine, -sine};
    case 2:
      return {-sine, -cosine};
    default:
      return {-cosine, sine};
  }
}

}  // namespace moldloft::host_sim
