#include "firmware_like/gateway/service_notify.hpp"

#include "hal/base/printable_text.hpp"

#include <fmt/format.h>
#include <systemd/sd-daemon.h>

#include <cstdint>

namespace moldloft::firmware_like {

ServiceNotify::ServiceNotify() {
  std::uint64_t limit_us = 0;
  // Positive only when the limit is meant for this very process, not for one that has started it.
  if (sd_watchdog_enabled(0, &limit_us) > 0) watchdog_ = std::chrono::microseconds{limit_us};
}

// A line end in a status would begin an assignment of its own.
void ServiceNotify::ready(std::string_view status) {
  sd_notify(0, fmt::format("READY=1\nSTATUS={}", hal::printable(status)).c_str());
}

void ServiceNotify::status(std::string_view status) {
  sd_notify(0, fmt::format("STATUS={}", hal::printable(status)).c_str());
}

void ServiceNotify::stopping(std::string_view status) {
  sd_notify(0, fmt::format("STOPPING=1\nSTATUS={}", hal::printable(status)).c_str());
}

void ServiceNotify::feed() { sd_notify(0, "WATCHDOG=1"); }

}  // namespace moldloft::firmware_like
