#include "host_sim/cell/cell_description.hpp"

#include "host_sim/base/plan_polygon.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <filesystem>
#include <numbers>
#include <vector>

namespace moldloft::host_sim {

namespace {

constexpr double field_over_table_mm = 15;
constexpr double look_beyond_mm = 20;  // a tracker's field of view hangs over the edge
constexpr double nearest_places_mm = 5;
constexpr double field_radius_mm = 75;  // the field's corners are 72 mm from its centre

Eigen::Vector2d middle_of(const CellDescription& cell) {
  if (cell.arm == ArmKind::scara) return {510.0, 0.0};
  return (cell.gantry.low_mm + 0.5 * cell.gantry.size_mm).head<2>();
}

std::expected<std::shared_ptr<const Plate>, SimError> shaped(const CellDescription& cell, Shape shape) {
  return make_plate({shape, outline_corners(cell.outline, cell.sizes), cell.thickness_mm, cell.amplitude_mm,
                     cell.radius_mm});
}

std::expected<std::shared_ptr<const Plate>, SimError> plate_of(const CellDescription& cell) {
  if (cell.made) return cell.made;
  if (cell.formed) {
    const auto base = cell.formed->shape ? shaped(cell, *cell.formed->shape) : designed_plate(cell);
    return base ? make_formed_plate(*base, *cell.formed) : base;
  }
  return designed_plate(cell);
}

PlateInstance put_down(const std::shared_ptr<const Plate>& plate, const Placement& place) {
  const Eigen::Vector2d middle = centroid(plate->outline());
  const Eigen::Vector2d turned = Eigen::Rotation2Dd(place.turn) * middle;
  return resting_on_table(plate, place.x_mm - turned.x(), place.y_mm - turned.y(), place.turn);
}

// Points of the outline where the arm is asked whether it reaches: a ragged border of a scan is asked every few
// millimetres, not at each of its thousands of vertices.
std::vector<Eigen::Vector2d> places_along(PlanPoints outline) {
  std::vector<Eigen::Vector2d> places;
  for (const auto& p : sampled_outline(outline, 25.0)) {
    if (places.empty() || (p - places.back()).norm() >= nearest_places_mm) places.push_back(p);
  }
  return places;
}

bool in_reach(const CellDescription& cell, const Arm& arm, const PlateInstance& plate, PlanPoints places) {
  const double z = plate.z_mm;
  const Eigen::Vector2d middle = plate.to_world(centroid(plate.plate->outline()));
  for (const auto& p : places) {
    Eigen::Vector2d w = plate.to_world(p);
    w += look_beyond_mm * (w - middle).normalized();
    for (double heading = 0; heading < std::numbers::pi; heading += 15 * hal::degree) {
      if (!can_look(arm, {w.x(), w.y(), z}, heading, cell.tip_from_scanner)) return false;
    }
  }
  return true;
}

geometry::RigidMotion world_from_tip_over(const Eigen::Vector3d& field_centre, double heading,
                                          const geometry::RigidMotion& tip_from_scanner) {
  return geometry::turned_about_z(heading, field_centre) * tip_from_scanner.inverse();
}

// The plate's centre of area to the nearest side: how much plate there is around the start.
double inner_radius(const Plate& plate) {
  return distance_to_outline(plate.outline(), centroid(plate.outline()));
}

}  // namespace

std::expected<ArmKind, SimError> arm_named(std::string_view name) {
  if (name == "scara") return ArmKind::scara;
  if (name == "gantry") return ArmKind::gantry;
  return std::unexpected(SimError{fmt::format("no arm is called '{}': choose scara or gantry", name)});
}

geometry::RigidMotion nominal_mount() {
  geometry::RigidMotion mount = geometry::RigidMotion::Identity();
  mount.translation() = Eigen::Vector3d{0.0, 140.0, 300.0};
  mount.linear() = Eigen::DiagonalMatrix<double, 3>(1.0, -1.0, -1.0);  // half a turn about x
  return mount;
}

bool is_mesh(const CellDescription& cell) {
  if (shape_named(cell.plate)) return false;
  std::string name = cell.plate;
  std::ranges::transform(name, name.begin(),
                         [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  std::error_code unknown;
  return name.find('/') != name.npos || name.ends_with(".ply") || name.ends_with(".stl") ||
         std::filesystem::exists(cell.plate, unknown);
}

std::expected<std::shared_ptr<const Plate>, SimError> designed_plate(const CellDescription& cell) {
  if (is_mesh(cell)) {
    return read_mesh_plate(cell.plate, cell.unit.value_or(LengthUnit::millimetre), cell.thickness_mm);
  }
  const auto shape = shape_named(cell.plate);
  if (!shape)
    return std::unexpected(SimError{shape.error().what + ", or give the path of a PLY or STL file"});
  return shaped(cell, *shape);
}

std::unique_ptr<Arm> make_arm(const CellDescription& cell) {
  return cell.arm == ArmKind::scara ? make_scara(cell.scara) : make_gantry(cell.gantry);
}

bool can_look(const Arm& arm, const Eigen::Vector3d& field_centre, double stripe_heading,
              const geometry::RigidMotion& tip_from_scanner) {
  const auto reachable = [&](double heading) {
    return arm
        .joints_for(read_back_pose(world_from_tip_over(field_centre, heading, tip_from_scanner)), arm.home())
        .has_value();
  };
  return reachable(stripe_heading) || reachable(stripe_heading + std::numbers::pi);
}

std::expected<PlateInstance, SimError> placed_plate(const CellDescription& cell) {
  const auto plate = plate_of(cell);
  if (!plate) return std::unexpected(plate.error());
  const auto arm = make_arm(cell);
  const auto places = places_along((*plate)->outline());
  const auto no_place = [&] {
    return SimError{
        fmt::format("plate '{}' ({:.0f} x {:.0f} mm) does not fit under the {} arm: choose a smaller plate, "
                    "another place or another arm",
                    cell.plate, (*plate)->bounds().max.x() - (*plate)->bounds().min.x(),
                    (*plate)->bounds().max.y() - (*plate)->bounds().min.y(), arm->name())};
  };
  if (cell.placement) {
    const auto instance = put_down(*plate, *cell.placement);
    if (!in_reach(cell, *arm, instance, places)) return std::unexpected(no_place());
    return instance;
  }
  const Eigen::Vector2d middle = middle_of(cell);
  const double room = std::max(0.0, inner_radius(**plate) - field_radius_mm);
  Random random(cell.seed, Stream::placement);
  for (int attempt = 0; attempt < 200; ++attempt) {
    Eigen::Vector2d shift{random.uniform(-30.0, 30.0), random.uniform(-60.0, 60.0)};
    if (shift.norm() > room) shift *= room / shift.norm();
    const double turn = random.uniform(-std::numbers::pi, std::numbers::pi);
    const auto instance = put_down(*plate, {middle.x() + shift.x(), middle.y() + shift.y(), turn});
    if (in_reach(cell, *arm, instance, places)) return instance;
  }
  return std::unexpected(no_place());
}

hal::Pose start_pose(const CellDescription& cell) {
  const Eigen::Vector2d middle = middle_of(cell);
  return read_back_pose(
      world_from_tip_over({middle.x(), middle.y(), field_over_table_mm}, 0.0, nominal_mount()));
}

}  // namespace moldloft::host_sim
