// The plate that the inspection benchmarks work on: 23 x 23 bicubic control points, 305 x 305 mm, about
// +-20 mm, like job P of the fit; and points at known places of it, from a generator that is the same
// on every machine.
#pragma once

#include "geometry/rigid_motion.hpp"
#include "geometry/splines/bspline.hpp"

#include <cmath>
#include <cstdint>
#include <vector>

namespace moldloft::bench {

constexpr double plate_side_mm = 305;

inline geometry::BSplineSurface bench_surface() {
  const std::vector<double> knots = geometry::uniform_clamped_knots(20);
  geometry::BSplineSurface s{knots, knots, Eigen::MatrixXd(23, 23), Eigen::MatrixXd(23, 23),
                             Eigen::MatrixXd(23, 23)};
  for (int i = 0; i < 23; ++i) {
    for (int j = 0; j < 23; ++j) {
      const double u = geometry::greville(knots, i), v = geometry::greville(knots, j);
      s.x(i, j) = plate_side_mm * u, s.y(i, j) = plate_side_mm * v;
      s.z(i, j) = 12 * std::sin(4 * u + 0.3) * std::cos(3 * v) + 32 * (u - 0.5) * (v - 0.5) +
                  1.5 * std::sin(9 * u + 7 * v);
    }
  }
  return s;
}

// Numbers in [0, 1) (SplitMix64), and from them normal ones (Box and Muller).
class Numbers {
 public:
  explicit Numbers(std::uint64_t seed) : state_(seed) {}
  double uniform() {
    std::uint64_t z = state_ += 0x9e3779b97f4a7c15U;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9U;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebU;
    return static_cast<double>((z ^ (z >> 31)) >> 11) * 0x1p-53;
  }
  double normal() { return std::sqrt(-2 * std::log(1 - uniform())) * std::cos(2 * M_PI * uniform()); }

 private:
  std::uint64_t state_;
};

// `rows` stripes of `columns` points in the order of a scan, off by normal noise along the normals.
inline std::vector<Eigen::Vector3d> scanned_points(const geometry::BSplineSurface& s, int rows, int columns,
                                                   double noise_mm, std::uint64_t seed) {
  Numbers numbers(seed);
  std::vector<Eigen::Vector3d> points;
  points.reserve(static_cast<std::size_t>(rows) * static_cast<std::size_t>(columns));
  for (int i = 0; i < rows; ++i) {
    for (int j = 0; j < columns; ++j) {
      const geometry::SurfacePoint r = s.at((i + 0.5) / rows, (j + 0.5) / columns);
      points.push_back(r.value + noise_mm * numbers.normal() * r.normal());
    }
  }
  return points;
}

// A turn by `degrees` and a way of `mm` in directions that the seed draws, about the plate's middle.
inline geometry::RigidMotion drawn_motion(double degrees, double mm, std::uint64_t seed) {
  Numbers numbers(seed);
  const auto direction = [&] {
    return Eigen::Vector3d(numbers.normal(), numbers.normal(), numbers.normal()).normalized();
  };
  const Eigen::Vector3d middle(plate_side_mm / 2, plate_side_mm / 2, 0);
  geometry::RigidMotion motion = geometry::RigidMotion::Identity();
  motion.linear() = Eigen::AngleAxisd(degrees * M_PI / 180, direction()).toRotationMatrix();
  motion.translation() = middle + mm * direction() - motion.linear() * middle;
  return motion;
}

}  // namespace moldloft::bench
