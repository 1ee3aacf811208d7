// A gantry: three linear axes and a flange that turns about the vertical, for parts that no SCARA spans.
#pragma once

#include "host_sim/arms/arm.hpp"

namespace moldloft::host_sim {

struct GantrySettings {
  Eigen::Vector3d low_mm{0.0, 0.0, 285.0};  // of the tip in the world
  Eigen::Vector3d size_mm{3000.0, 2000.0, 600.0};
  double turn_limit = 200 * hal::degree;
  double xy_speed_mm = 1000, xy_acceleration_mm = 2000;
  double z_speed_mm = 500, z_acceleration_mm = 2000;
  double turn_speed = 180 * hal::degree, turn_acceleration = 500 * hal::degree;

  // The machine as it truly is: how far y leans out of square with x.
  double squareness_error = 0;  // rad
};

std::unique_ptr<Arm> make_gantry(const GantrySettings&);

}  // namespace moldloft::host_sim
