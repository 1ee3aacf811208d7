// The factory of drivers: which class answers to which `driver` in the configuration. A new make is
// one line here.
#pragma once

#include "firmware_like/config/config.hpp"
#include "hal/links/byte_link.hpp"
#include "hal/robot/robot.hpp"
#include "hal/scanner/scanner.hpp"

#include <memory>

namespace moldloft::firmware_like {

std::unique_ptr<hal::Scanner> make_scanner(const ScannerConfig&, hal::ByteLink&);
std::unique_ptr<hal::Robot> make_robot(const RobotConfig&, hal::ByteLink&, std::uint32_t nonce);

}  // namespace moldloft::firmware_like
