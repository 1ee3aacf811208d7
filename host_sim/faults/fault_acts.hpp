// Faults at work: what the robot says, where the arm truly stands, what a frame shows, where the plate lies. What a
// fault draws it draws from the seed, in a stream of its own: the same seed without faults is the run it always was.
//
// Shots are counted as the scanner exposes them, from 1. A shot's faults are there from the end of the exposure before
// it to the end of its own.
//
// Units        mm, rad; world frame
// Thread       one thread
// Allocation   at construction; one frame where the scanner freezes
#pragma once

#include "geometry/rigid_motion.hpp"
#include "hal/robot/pose.hpp"
#include "hal/scanner/frame.hpp"
#include "host_sim/faults/fault.hpp"
#include "host_sim/plates/plate.hpp"

#include <optional>
#include <vector>

namespace moldloft::host_sim {

class FaultActs {
 public:
  FaultActs(const std::vector<Fault>&, std::uint64_t seed);

  // Before shot `shot` is driven to; `of_surface`: that one of the surface, 0 for none. Called as often as one likes.
  void next_shot_is(std::uint64_t shot, std::uint64_t of_surface);
  // The arm sets out for it: what it says from now on is of that shot.
  void arm_sets_out();

  // ---- constant
  geometry::RigidMotion mounted(const geometry::RigidMotion& tip_from_scanner) const;
  double noise_factor() const;

  // ---- of this shot
  hal::Pose robot_says(const hal::Pose& encoders) const;
  geometry::RigidMotion arm_stands(const geometry::RigidMotion& world_from_tip) const;
  bool robot_stays() const { return acting(FaultKind::robot_stays) != nullptr; }
  void spoil(hal::Frame&);
  PlateInstance lies(const PlateInstance& as_put_down) const;
  bool plate_has_moved() const { return plate_moved_; }

 private:
  struct Act {
    Fault fault;
    double heading = 0;       // of what has a direction in plan
    bool acts = false;        // on this shot
    bool is_said = false;     // of the shot that the arm went to last
    std::uint64_t shots = 0;  // so many it has acted on
  };
  const Act* acting(FaultKind) const;

  std::vector<Act> acts_;
  std::uint64_t shot_ = 0;
  bool plate_moved_ = false;
  std::optional<hal::Frame> frozen_;
};

}  // namespace moldloft::host_sim
