// What a simulated cell consists of, as one chooses it: plate, arm, scanner, mount, seed. Defaults are
// the thesis's cell.
//
// The seed draws where the plate lies, turned by any angle. Its centre of area is within 30 mm (x) and 60 mm
// (y) of the middle of the cell. For small plates it is nearer, so that the scanner's start over the middle
// sees plate everywhere. A placement is drawn again until the arm reaches all of it: the field of view over
// all of the outline and 20 mm beyond, with stripes in any direction.
//
// A stripe direction can be had from two headings half a turn apart. With the scanner 140 mm off the flange a
// SCARA reaches every direction, by one of the two, where the field's centre is 185 to 787 mm from the base
// (joint 1 aside); any heading whatever only from 372 to 660 mm. A plate of 305 mm needs the former.
#pragma once

#include "host_sim/arms/arm_drive.hpp"
#include "host_sim/arms/gantry_arm.hpp"
#include "host_sim/arms/scara_arm.hpp"
#include "host_sim/devices/robot_server.hpp"
#include "host_sim/devices/scanner_server.hpp"
#include "host_sim/faults/fault.hpp"
#include "host_sim/plates/formed_plate.hpp"
#include "host_sim/plates/mesh_plate.hpp"
#include "host_sim/plates/plate_shape.hpp"

#include <optional>
#include <string>

namespace moldloft::host_sim {

enum class ArmKind { scara, gantry };
std::expected<ArmKind, SimError> arm_named(std::string_view);

// The scanner 140 mm off the flange along the tip's y, its field's centre 300 mm below it, its z axis up again.
geometry::RigidMotion nominal_mount();

struct Placement {
  double x_mm = 0, y_mm = 0;  // of the plate's centre of area
  double turn = 0;
};

struct CellDescription {
  std::string plate = "saddle";       // a shape's name, or the path of a mesh file
  bool has_design = false;            // `plate` is what it was to become: the run's folder gets design.json
  std::optional<Mistakes> formed;     // what it became instead; nullopt: what it was to become
  std::shared_ptr<const Plate> made;  // a plate that neither describes; `plate` is then only its name
  std::optional<LengthUnit> unit;     // of that file; millimetres unless given
  OutlineKind outline = OutlineKind::square;
  OutlineSizes sizes;
  double thickness_mm = 6, amplitude_mm = 10, radius_mm = 1000;
  std::optional<Placement> placement;  // instead of one drawn from the seed

  ArmKind arm = ArmKind::scara;
  ScaraSettings scara;
  GantrySettings gantry;
  ArmDrive::Settings drive;
  OpticsSettings optics;
  std::string scanner_driver = "psc1";  // as the cell's configuration names the make
  MakeScannerDevice make_scanner = make_scanner_server;
  ScannerTimes scanner_times;
  RobotTimes robot_times;
  geometry::RigidMotion tip_from_scanner = nominal_mount();  // as it truly is, but for faults
  std::vector<Fault>
      faults;  // what is wrong on purpose; whoever writes the cell's configuration does not know

  std::uint64_t seed = 1;
};

// Whether the plate is a mesh file: its word is no shape's, and there is such a file or the word looks like one.
bool is_mesh(const CellDescription&);

// What the plate was to become; of a cell without a design the plate itself, without its mistakes.
std::expected<std::shared_ptr<const Plate>, SimError> designed_plate(const CellDescription&);

std::unique_ptr<Arm> make_arm(const CellDescription&);

// The plate on its place. Fails when it cannot be read or made, or when no place for it is found under the arm.
std::expected<PlateInstance, SimError> placed_plate(const CellDescription&);

// Over the middle of the cell, the field's centre 15 mm over the table, stripes along the world's y: where
// the nominal mount brings the field of view for a start inside any plate that placed_plate() puts down.
hal::Pose start_pose(const CellDescription&);

// Whether the arm brings the field's centre to this place of the world with stripes in this direction, by one
// of the two headings that give it.
bool can_look(const Arm&, const Eigen::Vector3d& field_centre, double stripe_heading,
              const geometry::RigidMotion& tip_from_scanner);

}  // namespace moldloft::host_sim
