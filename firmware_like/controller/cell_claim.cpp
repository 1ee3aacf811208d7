#include "firmware_like/controller/cell_claim.hpp"

#include <utility>

namespace moldloft::firmware_like {

std::expected<CellClaim, std::string> claim_cell(const CellConfig& config) {
  auto robot = claim_link(config.robot.place);
  if (!robot) return std::unexpected{robot.error()};
  auto scanner = claim_link(config.scanner.place);
  if (!scanner) return std::unexpected{scanner.error()};
  return CellClaim{std::move(*scanner), std::move(*robot)};
}

}  // namespace moldloft::firmware_like
