#include "firmware_like/controller/cell_claim.hpp"

#include <utility>

namespace moldloft::firmware_like {

std::expected<CellClaim, std::string> claim_cell(const CellConfig& config) {
  auto robot = hal::claim_serial(config.robot.device);
  if (!robot) return std::unexpected{robot.error()};
  auto scanner = hal::claim_address(config.scanner.host, static_cast<std::uint16_t>(config.scanner.port));
  if (!scanner) return std::unexpected{scanner.error()};
  return CellClaim{std::move(*scanner), std::move(*robot)};
}

}  // namespace moldloft::firmware_like
