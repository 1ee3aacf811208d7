// Fit job P: nine shots of 50,000 points in 100 stripes each, at 12 to 38 degrees,
// over a plate of 305 x 305 mm that is bent by +-20 mm; sigma 0.025 mm. Deterministic: the same bits on
// every machine with IEEE doubles and the same sine.
#pragma once

#include "geometry/splines/bspline.hpp"

#include <cstdint>
#include <span>
#include <vector>

namespace moldloft::bench {

constexpr double plate_mm = 305, noise_mm = 0.025;

// The plate's true height. A net of 23 x 23 follows it to 1e-4 mm, one of 8 x 8 misses 0.03 mm.
double true_height(double x, double y);

struct FitJob {
  std::vector<double> x, y, z;
  std::size_t size() const { return x.size(); }
};

FitJob fit_job(std::uint64_t seed = 1);
// Without the points within `radius` of the centre of the hole.
constexpr double hole_x = 160, hole_y = 145, hole_radius = 40;
FitJob with_hole(const FitJob&);
// One point of a hundred off by +-3 mm.
FitJob with_outliers(const FitJob&, std::uint64_t seed = 2);

// Error of a surface over the plate against the truth, on 301 x 301 points, inside and outside of the hole.
struct FitError {
  double rms = 0, max = 0, rms_inside = 0, rms_outside = 0;
};
FitError error_of(const geometry::BSplineSurface&);

}  // namespace moldloft::bench
