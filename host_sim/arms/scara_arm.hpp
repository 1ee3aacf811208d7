// A SCARA arm of the Adept One's size: joints 1 and 2 turn links of 425 and 375 mm in the plane, 3 moves the
// quill, 4 turns the flange. Joint 3 is counted as the tip's height over the world's z = 0.
//
// Limits: Adept One class (j1 +-150, j2 +-147, j4 +-277 degrees, stroke 195 mm). Speeds and accelerations are
// those for carrying a scanner, a third of what the arm could do.
#pragma once

#include "host_sim/arms/arm.hpp"

namespace moldloft::host_sim {

struct ScaraSettings {
  double link_1_mm = 425, link_2_mm = 375;
  double tip_low_mm = 295,
         stroke_mm = 195;  // the tip's heights: the scanner's field centre hangs 300 mm lower
  double j1_limit = 150 * hal::degree, j2_limit = 147 * hal::degree, j4_limit = 277 * hal::degree;
  double turn_speed = 180 * hal::degree, turn_acceleration = 500 * hal::degree;  // joints 1 and 2
  double z_speed_mm = 500, z_acceleration_mm = 2500;
  double flange_speed = 360 * hal::degree, flange_acceleration = 1500 * hal::degree;
  bool lefty =
      false;  // on which side of the line from base to tip the elbow is; an arm never changes it by itself

  // The arm as it truly is, where it differs from what its controller believes.
  double link_1_error_mm = 0, link_2_error_mm = 0, j2_zero_error = 0;
};

std::unique_ptr<Arm> make_scara(const ScaraSettings&);

}  // namespace moldloft::host_sim
