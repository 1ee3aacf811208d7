// Eight stripes at a time against each of them alone, point by point: the same pieces of the same points, to the bit,
// whatever the vector unit, however the stripes differ and whatever lies in them.
#include "geometry/edges/stripe_walk.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <cstring>
#include <limits>
#include <random>
#include <vector>

using namespace moldloft::geometry;

namespace {

constexpr Simd every_simd[] = {Simd::portable, Simd::avx2, Simd::avx512};

struct Stripe {
  std::vector<float> x, y, z;
  StripeView view() const { return {x, y, z}; }
};

struct Dirt {
  double missing = 0, outliers = 0, steps = 0, backwards = 0, gaps = 0;  // of a hundred points
  double bend = 0;                                                       // 1/mm, of waves of 20 mm
  bool uneven = false;                                                   // points from 0.02 to 0.4 mm apart
};

Stripe stripe(std::size_t points, const Dirt& dirt, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> noise(0, 0.05);
  std::uniform_real_distribution<double> percent(0, 100), unit(-1, 1);
  const float nothing[] = {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity(),
                           -std::numeric_limits<float>::infinity()};
  Stripe s;
  double base = 0, y = -50;
  for (std::size_t i = 0; i < points; ++i) {
    y += percent(random) < dirt.backwards ? -0.5 : dirt.uneven ? 0.21 + 0.19 * unit(random) : 0.2;
    if (percent(random) < dirt.gaps) y += 8 * std::abs(unit(random));
    if (percent(random) < dirt.steps) base = 20 * unit(random);
    double z = base + 4 * std::sin(y / 20) + 0.5 * dirt.bend * std::pow(std::fmod(y + 100, 20) - 10, 2) +
               noise(random);
    if (percent(random) < dirt.outliers) z += 10 * unit(random);
    s.x.push_back(static_cast<float>(0.01 * y)), s.y.push_back(static_cast<float>(y));
    s.z.push_back(static_cast<float>(z));
    if (percent(random) < dirt.missing) {
      auto& column = i % 3 == 0 ? s.x : i % 3 == 1 ? s.y : s.z;
      column.back() = nothing[i % 5 % 3];
    }
  }
  return s;
}

struct Walked {
  std::vector<std::uint32_t> good;
  std::vector<StripePiece> pieces;
  explicit Walked(const Stripe& s) : good(s.z.size() + 1), pieces(s.z.size() / fewest_piece_points + 2) {}
  StripeWalk begin(const Stripe& s) { return {s.view(), {}, good.data(), pieces.data()}; }
  void end(const StripeWalk& walk) { good.resize(walk.good().size()), pieces.resize(walk.pieces().size()); }
  bool operator==(const Walked& other) const {
    return good == other.good && pieces.size() == other.pieces.size() &&
           std::memcmp(pieces.data(), other.pieces.data(), pieces.size() * sizeof(StripePiece)) == 0;
  }
};

Walked alone(const Stripe& s) {
  Walked result(s);
  StripeWalk walk = result.begin(s);
  while (walk.step()) {
  }
  result.end(walk);
  return result;
}

// In pieces of `points`, which end anywhere, also in the middle of what interrupts a line.
void check_together_as_alone(const std::vector<Stripe>& stripes, Simd simd, std::size_t points) {
  std::vector<Walked> results(stripes.begin(), stripes.end());
  std::vector<StripeWalk> walks;
  for (std::size_t k = 0; k < stripes.size(); ++k) walks.push_back(results[k].begin(stripes[k]));
  while (!StripeWalk::walk_in_turn(walks, stripe_kernel(simd), points)) {
  }
  for (std::size_t k = 0; k < stripes.size(); ++k) {
    CAPTURE(k);
    results[k].end(walks[k]);
    CHECK(results[k] == alone(stripes[k]));
  }
}

}  // namespace

TEST_CASE("stripes walked eight at a time are cut as each of them alone would be") {
  const Dirt kinds[] = {{},
                        {.missing = 3, .outliers = 1},
                        {.missing = 20, .outliers = 10, .steps = 2},
                        {.steps = 5, .backwards = 5},
                        {.missing = 100},
                        {.gaps = 5, .bend = 0.15, .uneven = true}};
  std::size_t good = 0, pieces = 0;
  for (unsigned seed = 0; seed < 40; ++seed) {
    CAPTURE(seed);
    std::vector<Stripe> stripes;
    const std::size_t count = 1 + seed % 8;
    for (std::size_t k = 0; k < count; ++k) {
      // As long as a frame's, and as short as what a shadow leaves.
      const std::size_t points = seed % 4 == 3 ? (seed + 7 * k) % 30 : 480 + (seed * 13 + k * 5) % 40;
      stripes.push_back(
          stripe(points, kinds[(seed + k) % std::size(kinds)], 100 * seed + static_cast<unsigned>(k)));
      const Walked truth = alone(stripes.back());
      good += truth.good.size(), pieces += truth.pieces.size();
    }
    for (const Simd simd : every_simd) {
      if (!machine_has(simd)) continue;
      CAPTURE(to_string(simd));
      check_together_as_alone(stripes, simd, 1 + seed % 50);
    }
  }
  // The stripes must have had both: long smooth stretches, and what interrupts them.
  CHECK(good > 20'000);
  CHECK(pieces > 500);
}

TEST_CASE("a steady line leaves a walk in the state that it would have had alone") {
  // What is decided at a step depends on the line up to it: noise just at the limit, many times, in every phase
  // of the eight.
  for (unsigned seed = 0; seed < 200; ++seed) {
    std::vector<Stripe> stripes;
    for (std::size_t k = 0; k < 8; ++k) {
      Stripe s =
          stripe(300, {.backwards = 1, .gaps = 1, .bend = 0.02 * static_cast<double>(k), .uneven = true},
                 7000 + 8 * seed + static_cast<unsigned>(k));
      std::mt19937 random(seed);
      std::uniform_real_distribution<float> near_limit(0.24f, 0.34f);
      for (std::size_t i = 20 + k; i < 300; i += 17) s.z[i] += near_limit(random);
      stripes.push_back(s);
    }
    check_together_as_alone(stripes, widest_simd(), 100);
  }
}

TEST_CASE("a point at the limit of what goes on is in or out for eight stripes as for one") {
  // Flat and without noise, so that the distance from the line is the height: 0.28 mm of noise, 0.1 a millimetre of way
  // and 0.01 a square millimetre of bend are allowed, and nothing less for a step backwards.
  std::vector<Stripe> stripes(8);
  std::size_t good = 0;
  for (std::size_t k = 0; k < 8; ++k) {
    double y = 0;
    for (int i = 0; i < 100; ++i) {
      const bool far = i == 40 + static_cast<int>(k), back = i == 70;
      y += far ? 3.0 : back ? -0.5 : 0.2;
      const double z = far    ? 0.55 + 0.02 * static_cast<double>(k)
                       : back ? 0.22 + 0.01 * static_cast<double>(k)
                              : 0.0;
      stripes[k].x.push_back(0), stripes[k].y.push_back(static_cast<float>(y));
      stripes[k].z.push_back(static_cast<float>(z));
    }
    good += alone(stripes[k]).good.size();
  }
  CHECK(good < 800 - 2);  // some are out ...
  CHECK(good > 784 + 2);  // ... and some are in
  check_together_as_alone(stripes, widest_simd(), 100);
}
