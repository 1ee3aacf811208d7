// The simulation's own randomness: xoshiro256++ (Blackman and Vigna, 2019), seeded by splitmix64, and a
// Gaussian by Marsaglia's polar method. Nothing of the standard library's distributions, whose values are
// each vendor's own: a seed means the same numbers everywhere.
//
// A stream is named by (seed, stream, index), for instance (seed, optics, exposure 17). So what one device
// draws does not depend on what another has drawn.
#pragma once

#include "host_sim/base/portable_math.hpp"

#include <cmath>
#include <cstdint>

namespace moldloft::host_sim {

enum class Stream : std::uint64_t {
  placement = 1,
  optics = 2,
  arm = 3,
  sessions = 4,
  arm_errors = 5,
  faults = 6,
  hard = 7
};

class Random {
 public:
  Random(std::uint64_t seed, Stream stream, std::uint64_t index = 0) noexcept {
    std::uint64_t x = seed;
    x = split(x) ^ (static_cast<std::uint64_t>(stream) * 0xD1342543DE82EF95ull);
    x = split(x) ^ (index * 0x2545F4914F6CDD1Dull);
    for (auto& word : state_) word = split(x);
  }

  std::uint64_t next() noexcept {
    const std::uint64_t result = rotated(state_[0] + state_[3], 23) + state_[0];
    const std::uint64_t t = state_[1] << 17;
    state_[2] ^= state_[0];
    state_[3] ^= state_[1];
    state_[1] ^= state_[2];
    state_[0] ^= state_[3];
    state_[2] ^= t;
    state_[3] = rotated(state_[3], 45);
    return result;
  }

  double uniform() noexcept { return static_cast<double>(next() >> 11) * 0x1.0p-53; }  // [0, 1)
  double uniform(double low, double high) noexcept { return low + (high - low) * uniform(); }

  // Mean 0, standard deviation 1.
  double normal() noexcept {
    if (has_spare_) {
      has_spare_ = false;
      return spare_;
    }
    double a = 0, b = 0, s = 0;
    do {
      a = uniform(-1.0, 1.0);
      b = uniform(-1.0, 1.0);
      s = a * a + b * b;
    } while (s >= 1.0 || s == 0.0);
    const double scale = std::sqrt(-2.0 * portable_log(s) / s);
    spare_ = b * scale;
    has_spare_ = true;
    return a * scale;
  }

 private:
  static std::uint64_t rotated(std::uint64_t x, int k) noexcept { return (x << k) | (x >> (64 - k)); }
  static std::uint64_t split(std::uint64_t& x) noexcept {
    std::uint64_t z = (x += 0x9E3779B97F4A7C15ull);
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9ull;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EBull;
    return z ^ (z >> 31);
  }

  std::uint64_t state_[4];
  double spare_ = 0;
  bool has_spare_ = false;
};

}  // namespace moldloft::host_sim
