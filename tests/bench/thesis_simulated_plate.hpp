// The plate of section 6.4 as a formula, and what nine shots see of it: the thesis prints its size, the shots
// and the stripes, not the measured points.
#pragma once

#include "bench/thesis_parts.hpp"

#include <Eigen/Core>

#include <vector>

namespace moldloft::bench {

constexpr double plate_size_mm = 305;
constexpr double height_noise_mm = 0.025;  // the scanner's height accuracy
constexpr double robot_error_mm = 0.076;   // the robot's, in x and y, one draw a shot

// A saddle as line heating leaves it, with the shallow furrow of every heating line. x, y
// in [0, plate_size_mm].
double plate_height(double x, double y);

struct Noise {
  double height_mm = 0, shot_mm = 0;
};

// `count` stripes shared out among 3 x 3 shots in a zig-zag without overlap, each straight in plan view and
// as long as its shot. uv is the plan position that the robot believes over plate_size_mm, points are in mm.
std::vector<SampledStripe> plate_stripes(int count, int points_a_stripe, const Noise&, unsigned seed);

}  // namespace moldloft::bench
