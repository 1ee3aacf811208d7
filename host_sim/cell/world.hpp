// The simulated cell: a plate on a table, an arm that carries a scanner, and the two device servers,
// in one thread.
//
//     auto plate = placed_plate(description);
//     hal::Cable scanner_cable(clock, {}), robot_cable(clock, {.bytes_per_second = 11520});
//     SimulatedWorld world(description, *plate, scanner_cable.device(), robot_cable.device());
//     ... each tick: world.step(clock.now());
//
// The controller has the cables' host() ends, or in real time a socket and a serial port.
//
// Time         whatever clock the caller looks at; step() must see it go forward
// Allocation   in the constructor only, where the links do not allocate
#pragma once

#include "host_sim/cell/cell_description.hpp"
#include "host_sim/faults/fault_acts.hpp"

namespace moldloft::host_sim {

// Where the time went, from the first command that a device took to the last that it had done.
struct CellTimes {
  hal::Duration total{0};
  hal::Duration moving{0};  // the arm's joints turn, or it calibrates
  hal::Duration settling{0};
  hal::Duration exposing{0};
  hal::Duration computing{0};  // the scanner computes a frame
  hal::Duration idle{0};       // none of these: the controller's own

  double idle_fraction() const noexcept { return share(idle); }
  double standing_fraction() const noexcept { return 1.0 - share(moving); }

 private:
  double share(hal::Duration part) const noexcept {
    return total.count() > 0 ? static_cast<double>(part.count()) / static_cast<double>(total.count()) : 0.0;
  }
};

class SimulatedWorld final : public Scene, private RobotWhim {
 public:
  SimulatedWorld(const CellDescription&, PlateInstance, hal::ByteLink& scanner_device,
                 hal::ByteLink& robot_device);

  void step(hal::Instant now);

  const PlateInstance& plate() const override { return plate_; }  // where it lies now
  bool plate_has_moved() const { return faults_.plate_has_moved(); }
  // The shots from now on are of the surface, as far as faults ask for that.
  void surface_begins() noexcept {
    if (surface_from_ == 0) surface_from_ = scanner_->counters().exposures + 1;
  }
  geometry::RigidMotion world_from_scanner(hal::Instant at) const override;
  geometry::RigidMotion world_from_tip(hal::Instant at) const {
    return faults_.arm_stands(robot_.drive().true_world_from_tip(at));
  }

  CellTimes times() const noexcept { return at_last_done_; }
  ScannerDevice& scanner() noexcept { return *scanner_; }
  RobotServer& robot() noexcept { return robot_; }

 private:
  hal::Pose says(const hal::Pose& encoders) const override { return faults_.robot_says(encoders); }
  bool stays() const override { return faults_.robot_stays(); }
  void spoil(hal::Frame& frame) const override { faults_.spoil(frame); }
  void look_at_faults(hal::Instant now);
  void account(hal::Instant now);

  bool has_faults_;
  mutable FaultActs faults_;  // a frozen scanner remembers what it has seen
  PlateInstance put_down_, plate_;
  hal::Instant set_out_{0};         // when the arm did last
  std::uint64_t surface_from_ = 0;  // the shot with which the surface begins; 0: not yet
  geometry::RigidMotion tip_from_scanner_;
  RobotServer robot_;
  hal::Duration exposure_;  // of a shot
  std::unique_ptr<ScannerDevice> scanner_;

  bool began_ = false;
  hal::Instant accounted_{0};
  std::uint64_t done_ = 0;
  CellTimes so_far_, at_last_done_;
};

}  // namespace moldloft::host_sim
