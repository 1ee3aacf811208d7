// Watches the control loop from outside and keeps the service manager informed: its watchdog is fed only
// while the loop's heartbeat advances. When it does not, feeding ends, and the task in which the loop
// hangs is named: on stderr, in the status and in a file of the run's folder. So the culprit is known
// after the manager's kill.
//
// Thread       one ordinary thread (service_thread.hpp)
// Blocking     writes one small file when the loop stands
// Allocation   yes
// Failure      none
#pragma once

#include "firmware_like/gateway/service_notify.hpp"
#include "hal/base/clock.hpp"

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

namespace moldloft::firmware_like {

// The loop, as it is seen from outside at one moment.
struct LoopSight {
  std::uint64_t ticks = 0;  // its heartbeat; 0: it has not begun
  std::string_view task;    // that is running now
  std::string status;       // one line for a person
  bool ended = false;       // no more ticks will come; results are being written
};

class ServiceWatch {
 public:
  // Looks come at this distance. Time between two looks counts as no more than twice this. When the whole
  // program was stopped (by a debugger, a suspended machine), the loop is not to blame.
  static constexpr hal::Duration period = std::chrono::milliseconds{100};

  ServiceWatch(ServiceNotify&, std::filesystem::path report);

  void look(const LoopSight&, hal::Instant now);
  hal::Duration limit() const { return limit_; }  // of a heartbeat that does not advance
  bool stands() const { return told_; }

 private:
  void say_status(const LoopSight&, hal::Instant now);
  void tell_culprit(const LoopSight&);
  void tell_recovery(const LoopSight&, hal::Instant now);

  ServiceNotify& notify_;
  std::filesystem::path report_;
  hal::Duration limit_;
  std::uint64_t ticks_ = 0;
  hal::Duration standing_{0}, winding_up_{0};
  std::optional<hal::Instant> last_look_, last_status_;
  std::string status_;
  bool ready_ = false, told_ = false, stopping_ = false;
};

}  // namespace moldloft::firmware_like
