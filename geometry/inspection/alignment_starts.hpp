// Where an alignment may start: the outline of a plate laid on the border of its design in plan, from all sides.
//
// Method       24 turns about the normal, either way up, each moved by Gauss-Newton on the distances across the border;
//              what comes to rest in one place counts once. A square has four that are equally good, and only the
//              surface tells them apart
// Frame        the plate's, and the motion to the design's; mm
// Cost         some 10 ms
// Allocation   yes
// Failure      an empty result: no edge points, or all of them in one place
#pragma once

#include "geometry/inspection/plate_alignment.hpp"

#include <vector>

namespace moldloft::geometry {

struct AlignmentStart {
  RigidMotion design_from_plate = RigidMotion::Identity();
  double border_rms_mm = 0;
  bool upside_down = false;  // the plate's up lies on the other side than the design's
};

// The best first, at most eight. `edges` are evenly spread along the outline.
std::vector<AlignmentStart> alignment_starts(const DesignFaces&, std::span<const Eigen::Vector3d> edges,
                                             const Eigen::Vector3d& plate_up);

}  // namespace moldloft::geometry
