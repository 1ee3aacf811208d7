// The last check before a target goes to the robot: finite, inside the workspace, not too long a step, not
// too fast. A target that fails is never sent; the message names the limit. The first check of what the robot says of
// where it stands is here too: nothing is measured with a pose that cannot be.
//
// Units mm and rad, world frame. Pure, no allocation.
#pragma once

#include "hal/base/fixed_text.hpp"
#include "hal/base/realtime.hpp"
#include "hal/robot/pose.hpp"

#include <array>
#include <optional>

namespace moldloft::tasks {

struct Range {
  double min = 0, max = 0;
  bool contains(double v) const { return v >= min && v <= max; }
};

struct Workspace {
  Range x_mm{-2000, 2000}, y_mm{-2000, 2000}, z_mm{-500, 1000};  // of the robot's tip
  Range reach_mm{0, 1e9};     // distance of the tip from the robot's axis: a SCARA reaches a ring
  double max_step_mm = 2000;  // from where it stands
  int max_speed_percent = 100;
  // How far outside an arm may say that it stands before its first target: parked, or moved by hand. What lies farther
  // off is another unit, another frame, or an arm that does not know where it is.
  double parked_mm = 200;
};

// How far from its target an arm that says it has arrived may stand, and how far it may drift while it stands.
// Arms settle within hundredths of a millimetre. A pose this far off comes from a wrong tool, a wrong frame,
// another convention of angles, digits that the line has changed, or an arm that was stopped on its way. A lie
// below these bounds leaves an outline within the 0.3 mm that it is promised to, half of which it needs itself.
// At the field's centre 0.03 degrees are 0.17 mm.
struct Arrival {
  double distance_mm = 0.15, turn_rad = 0.03 * hal::degree;
};

// Nothing when the target may be sent; else one line: which limit, by how much.
std::optional<hal::Message> refuse_target(const hal::Pose& target, const hal::Pose& standing,
                                          int speed_percent, const Workspace& workspace) MOLDLOFT_NONBLOCKING;

// Nothing when the pose that was read back is where the arm was sent; else one line that says how far off it is.
std::optional<hal::Message> refuse_arrival(const hal::Pose& reported, const hal::Pose& commanded,
                                           const Arrival&) MOLDLOFT_NONBLOCKING;

// Nothing when an arm that has just been found may stand there; else one line that says which limit it is beyond.
std::optional<hal::Message> refuse_standing(const hal::Pose& reported,
                                            const Workspace& workspace) MOLDLOFT_NONBLOCKING;

// Nothing when an arm that was sent nowhere still stands where it stood; else one line that says how far off it is.
std::optional<hal::Message> refuse_drift(const hal::Pose& reported, const hal::Pose& stood,
                                         const Arrival&) MOLDLOFT_NONBLOCKING;

}  // namespace moldloft::tasks
