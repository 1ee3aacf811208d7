// Whether a part of the scanner's field has gone dark: dirt on its window, a shutter half open, a cable before it.
//
// What such a scanner sees of a plate ends at the same place of its field in every stripe and every shot, wherever it
// looks. A plate's edge may do so too while the scanner goes along it, but then it is one line in the world.
//
// Frame        the scanner's y, along its stripes, mm
// Cost         some microseconds a shot
// Thread       any; no allocation
#pragma once

#include "hal/base/realtime.hpp"
#include "tasks/cell/shot_evidence.hpp"

#include <cstddef>
#include <optional>

namespace moldloft::tasks {

struct BlindBand {
  std::size_t shot = 0;  // its place in the evidence: the first of those up to the last
  double y_mm = 0;       // points end here, or begin
  bool is_low = false;   // what is dark lies below y_mm
  double share(double field_mm) const { return 0.5 + (is_low ? y_mm : -y_mm) / field_mm; }
};

// Looks at the last shots that have seen the plate.
std::optional<BlindBand> blind_band(const RunEvidence&, double field_y_mm) MOLDLOFT_NONBLOCKING;

}  // namespace moldloft::tasks
