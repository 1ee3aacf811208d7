// `moldloft check --connect`: do both devices answer, and what do they say of themselves? The scanner is
// greeted, configured and asked for one exposure; the robot is asked SYN, STA and POS. Nothing that moves the
// arm is ever sent.
//
// Thread       the caller's
// Blocking     until both have answered or the configuration's device_timeout_s is over, whichever is first
// Allocation   yes
// Failure      in the reports, one line each: what the driver says
#pragma once

#include "firmware_like/config/config.hpp"
#include "hal/base/clock.hpp"
#include "hal/links/byte_link.hpp"

#include <cstdint>
#include <string>
#include <vector>

namespace moldloft::firmware_like {

struct DeviceReport {
  bool ok = false;
  std::string text;                   // what it is and says, or why there is nothing
  std::vector<std::string> warnings;  // where it differs from the configuration
};

struct DeviceReports {
  DeviceReport scanner, robot;
};

// `shot_id`: of the exposure; not 0, and never used before with this scanner.
DeviceReports try_devices(const CellConfig&, hal::Clock&, hal::ByteLink& scanner, hal::ByteLink& robot,
                          std::uint32_t shot_id);

}  // namespace moldloft::firmware_like
