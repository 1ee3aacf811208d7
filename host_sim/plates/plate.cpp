#include "host_sim/plates/plate.hpp"

namespace moldloft::host_sim {

geometry::RigidMotion PlateInstance::world_from_plate() const {
  return geometry::turned_about_z(turn, {x_mm, y_mm, z_mm});
}

Eigen::Vector2d PlateInstance::to_world(const Eigen::Vector2d& plan) const {
  return (world_from_plate() * Eigen::Vector3d{plan.x(), plan.y(), 0.0}).head<2>();
}

std::array<Eigen::Vector2d, 4> PlateInstance::corners_in_world() const {
  std::array<Eigen::Vector2d, 4> corners;
  for (std::size_t i = 0; i < 4; ++i) corners[i] = to_world(plate->corners()[i]);
  return corners;
}

PlateInstance resting_on_table(std::shared_ptr<const Plate> plate, double x_mm, double y_mm, double turn,
                               double table_z_mm) {
  const double lowest = plate->bounds().z_min - plate->thickness_mm();
  return {std::move(plate), x_mm, y_mm, table_z_mm - lowest, turn, table_z_mm};
}

}  // namespace moldloft::host_sim
