// A pose of the robot's tip as the controllers of the field write it: position and V+'s ZYZ' Euler angles.
// Frame of reference: tip in world (world_from_tip). Angles inside the program are radians; the wire carries degrees.
#pragma once

#include <cmath>
#include <numbers>

namespace moldloft::hal {

constexpr double degree = std::numbers::pi / 180.0;

struct Pose {
  double x_mm = 0, y_mm = 0, z_mm = 0;
  double yaw = 0, pitch = 0, roll = 0;  // rad; rotation Rz(yaw) Ry(pitch) Rz(roll)

  friend bool operator==(const Pose&, const Pose&) = default;
};

inline bool is_finite(const Pose& p) noexcept {
  return std::isfinite(p.x_mm) && std::isfinite(p.y_mm) && std::isfinite(p.z_mm) && std::isfinite(p.yaw) &&
         std::isfinite(p.pitch) && std::isfinite(p.roll);
}

}  // namespace moldloft::hal
