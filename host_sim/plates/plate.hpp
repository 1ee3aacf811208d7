// The plate as it truly is: explicit (z over x, y) in plate coordinates, with an outline in plan and a
// thickness, and where it lies in the world.
//
// Frame        plate: x, y in plan, z up, mm; the placement carries it into the world
// Thread       any: a plate is never changed after it was made
// Allocation   at construction only
#pragma once

#include "geometry/rigid_motion.hpp"

#include <Eigen/Core>

#include <array>
#include <memory>
#include <string>
#include <vector>

namespace moldloft::host_sim {

struct SurfaceSample {
  double z = 0, slope_x = 0, slope_y = 0;  // z, dz/dx, dz/dy
};

struct PlateBounds {
  Eigen::Vector2d min, max;     // of the outline in plan
  double z_min = 0, z_max = 0;  // of the top surface inside the outline
};

class Plate {
 public:
  virtual ~Plate() = default;

  // The top surface. Outside the outline it goes on smoothly, so that a search may start there.
  virtual SurfaceSample sample(double x, double y) const noexcept = 0;
  virtual bool inside(double x, double y) const noexcept = 0;

  double height(double x, double y) const noexcept { return sample(x, y).z; }
  Eigen::Vector2d gradient(double x, double y) const noexcept {
    const auto s = sample(x, y);
    return {s.slope_x, s.slope_y};
  }
  Eigen::Vector3d normal(double x, double y) const noexcept {
    const auto s = sample(x, y);
    return Eigen::Vector3d{-s.slope_x, -s.slope_y, 1.0}.normalized();
  }

  const std::string& name() const noexcept { return name_; }
  const std::vector<Eigen::Vector2d>& outline() const noexcept {
    return outline_;
  }  // counter-clockwise, closed
  // Borders of holes in it, clockwise, so that the plate lies on their left too; empty for most.
  const std::vector<std::vector<Eigen::Vector2d>>& holes() const noexcept { return holes_; }
  const std::array<Eigen::Vector2d, 4>& corners() const noexcept { return corners_; }  // counter-clockwise
  // What a person should know of a plate that was read from a file; one line without an end, empty for formulas.
  const std::string& remarks() const noexcept { return remarks_; }
  double thickness_mm() const noexcept { return thickness_mm_; }
  const PlateBounds& bounds() const noexcept { return bounds_; }

 protected:
  std::string name_, remarks_;
  std::vector<Eigen::Vector2d> outline_;
  std::vector<std::vector<Eigen::Vector2d>> holes_;
  std::array<Eigen::Vector2d, 4> corners_{};
  double thickness_mm_ = 0;
  PlateBounds bounds_;
};

// A plate on the table: turned about z, shifted, its lowest underside touching the table. The side walls are
// vertical, the underside is the top surface shifted down by the thickness.
struct PlateInstance {
  std::shared_ptr<const Plate> plate;
  double x_mm = 0, y_mm = 0, z_mm = 0;  // of the plate's origin in the world
  double turn = 0;                      // rad, about world z
  double table_z_mm = 0;                // of the table in the world

  geometry::RigidMotion world_from_plate() const;
  Eigen::Vector2d to_world(const Eigen::Vector2d& plan) const;
  std::array<Eigen::Vector2d, 4> corners_in_world() const;
};

PlateInstance resting_on_table(std::shared_ptr<const Plate>, double x_mm, double y_mm, double turn,
                               double table_z_mm = 0);

}  // namespace moldloft::host_sim
