#include "bench/thesis_simulated_plate.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

namespace moldloft::bench {

using Eigen::Vector2d, Eigen::Vector3d;

double plate_height(double x, double y) {
  const double s = x / plate_size_mm - 0.5, t = y / plate_size_mm - 0.5;
  double height =
      6 * (1 - 4 * s * s) * (1 - 4 * t * t) + 28 * s * s - 36 * t * t + 20 * s * t + 12 * s * s * t;
  for (const double line : {-0.3, -0.1, 0.1, 0.3}) {
    const double across = (s + 0.2 * t - line) / 0.06;
    height -= 0.25 * std::exp(-across * across);
  }
  return height;
}

std::vector<SampledStripe> plate_stripes(int count, int points_a_stripe, const Noise& noise, unsigned seed) {
  constexpr int shots = 9;
  constexpr double inset = 0.2 / plate_size_mm;  // the last point of a stripe lies inside the border
  std::mt19937 random(seed);
  std::normal_distribution<double> normal(0, 1);
  std::vector<SampledStripe> all;
  for (int shot = 0; shot < shots; ++shot) {
    const int row = shot / 3, column = row % 2 == 0 ? shot % 3 : 2 - shot % 3;
    const Vector2d low(std::max(inset, column / 3.0), std::max(inset, row / 3.0));
    const Vector2d high(std::min(1 - inset, (column + 1) / 3.0), std::min(1 - inset, (row + 1) / 3.0));
    const Vector2d error = noise.shot_mm * Vector2d(normal(random), normal(random)) / plate_size_mm;
    // The head turns from shot to shot, and the other way every second time: acute to every border.
    const double slope = (shot % 2 == 0 ? 1 : -1) * (12 + 26.0 * shot / (shots - 1)) * std::numbers::pi / 180;
    const int stripes = count * (shot + 1) / shots - count * shot / shots;
    for (int s = 0; s < stripes; ++s) {
      const Vector2d along(std::sin(slope), std::cos(slope)), across(along.y(), -along.x());
      const Vector2d middle = 0.5 * (low + high), size = high - low;
      const double reach = size.x() * std::abs(along.y()) + size.y() * std::abs(along.x());
      const Vector2d through = middle + reach * ((s + 0.5) / stripes - 0.5) * across;
      const Line in_shot = within_square((through - low).cwiseQuotient(size), along.cwiseQuotient(size));
      const Vector2d from = low + in_shot.from.cwiseProduct(size), to = low + in_shot.to.cwiseProduct(size);
      SampledStripe stripe;
      for (int i = 0; i < points_a_stripe; ++i) {
        const Vector2d at = from + i / (points_a_stripe - 1.0) * (to - from);
        // Where the robot believes the point to be; it is seen where the robot really is.
        const Vector2d believed = (at + error).cwiseMax(0).cwiseMin(1);
        const double z =
            plate_height(plate_size_mm * at.x(), plate_size_mm * at.y()) + noise.height_mm * normal(random);
        stripe.uv.push_back(believed);
        stripe.points.emplace_back(plate_size_mm * believed.x(), plate_size_mm * believed.y(), z);
      }
      all.push_back(std::move(stripe));
    }
  }
  return all;
}

}  // namespace moldloft::bench
