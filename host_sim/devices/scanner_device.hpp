// A simulated scanner of any make, as the world sees it. It serves its protocol on a byte link, looks at a
// scene, and says what it is doing.
//
// Thread       one thread; step() as often as time is looked at
// Blocking     never
// Allocation   at construction only
#pragma once

#include "geometry/rigid_motion.hpp"
#include "hal/base/clock.hpp"
#include "hal/links/byte_link.hpp"
#include "host_sim/optics/optics.hpp"

#include <cstdint>
#include <memory>

namespace moldloft::host_sim {

// What the scanner looks at. True positions, not reported ones.
class Scene {
 public:
  virtual ~Scene() = default;
  virtual const PlateInstance& plate() const = 0;
  virtual geometry::RigidMotion world_from_scanner(hal::Instant at) const = 0;
  // What is wrong with a frame that has just been exposed, done to it.
  virtual void spoil(hal::Frame&) const {}
};

struct ScannerTimes {
  hal::Duration exposure = std::chrono::microseconds{100};
  hal::Duration processing = std::chrono::milliseconds{100};
};

struct ScannerCounters {
  std::uint64_t exposures = 0, frames_sent = 0, repeats = 0, errors_sent = 0, connections = 0, dropped = 0;
};

class ScannerDevice {
 public:
  virtual ~ScannerDevice() = default;

  virtual void step(hal::Instant now) = 0;
  virtual void power_cycle() = 0;  // everything is forgotten

  // The last shot's work: exposing and computing in [busy_from, busy_until).
  virtual hal::Instant busy_from() const noexcept = 0;
  virtual hal::Instant busy_until() const noexcept = 0;
  virtual const ScannerCounters& counters() const noexcept = 0;
};

// What a make needs to be made of; null stands for none.
using MakeScannerDevice = std::unique_ptr<ScannerDevice> (*)(hal::ByteLink&, Optics, const Scene&,
                                                             const ScannerTimes&, std::uint64_t seed);

}  // namespace moldloft::host_sim
