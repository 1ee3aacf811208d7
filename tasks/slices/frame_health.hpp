// What a frame says of the scanner itself: how many of its points are there, how much they scatter, and whether it is
// the frame before once more.
//
// The scatter is the median of second differences along the stripes, which slopes and edges hardly touch: good to a
// tenth where the plate's bend within two points is below the noise.
//
// Cost         10 us; looks at some hundreds of points, spread over the frame
// Thread       any; no allocation
#pragma once

#include "hal/base/fixed_text.hpp"
#include "hal/base/realtime.hpp"
#include "hal/scanner/frame.hpp"

#include <cstdint>
#include <optional>

namespace moldloft::tasks {

struct FrameHealth {
  int looked_at = 0, missing = 0;  // points
  double noise_mm = 0;             // standard deviation of a height; 0: too few points to tell
  std::uint64_t fingerprint = 0;  // of what was looked at; no two exposures have the same when there is noise
};

// Every point of the frame must be unpacked.
FrameHealth health_of(const hal::Frame&) MOLDLOFT_NONBLOCKING;

// The scanner's fault, where there is one that makes its frames useless: what was seen and what to do.
bool is_blind(const FrameHealth&) MOLDLOFT_NONBLOCKING;
std::optional<hal::Message> scanner_fault(const FrameHealth&, double promised_noise_mm) MOLDLOFT_NONBLOCKING;

}  // namespace moldloft::tasks
