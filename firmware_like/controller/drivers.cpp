#include "firmware_like/controller/drivers.hpp"

#include "hal/robot/line_robot.hpp"
#include "hal/scanner/psc_scanner.hpp"

#include <cassert>

namespace moldloft::firmware_like {

std::unique_ptr<hal::Scanner> make_scanner(const ScannerConfig& config, hal::ByteLink& link) {
  if (config.driver == "psc1") {
    hal::PscScanner::Settings s;
    s.encoding = config.encoding;
    s.max_stripes = static_cast<std::uint32_t>(config.max_stripes);
    s.max_points = static_cast<std::uint32_t>(config.max_stripes * config.max_points_per_stripe);
    return std::make_unique<hal::PscScanner>(link, s);
  }
  assert(!"the configuration admits only known drivers");
  return nullptr;
}

std::unique_ptr<hal::Robot> make_robot(const RobotConfig& config, hal::ByteLink& link, std::uint32_t nonce) {
  if (config.driver == "line") {
    return std::make_unique<hal::LineRobot>(
        link, hal::LineRobot::Settings{.baud = config.baud, .first_nonce = nonce});
  }
  assert(!"the configuration admits only known drivers");
  return nullptr;
}

}  // namespace moldloft::firmware_like
