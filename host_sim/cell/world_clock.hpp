// Virtual time that carries the simulated devices along, and the serial line between them and the controller.
//
// Thread       the simulation's one
// Blocking     never; paced by the wall clock, in the controller's sleep
#pragma once

#include "hal/base/clock.hpp"
#include "host_sim/cell/world.hpp"

#include <optional>

namespace moldloft::host_sim {

inline constexpr double serial_bytes_per_second = 11520;  // 115200 baud, 8N1

class WorldClock final : public hal::VirtualClock {
 public:
  void carry(SimulatedWorld& world) { world_ = &world; }
  void pace_by_wall() { wall_.emplace(); }

 protected:
  void advance(hal::Instant wake) noexcept override {
    if (wall_) wall_->sleep_until(wake);
    if (world_ != nullptr) world_->step(wake);
  }

 private:
  SimulatedWorld* world_ = nullptr;
  std::optional<hal::SteadyClock> wall_;
};

}  // namespace moldloft::host_sim
