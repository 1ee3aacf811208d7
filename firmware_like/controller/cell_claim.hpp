// A cell's devices, claimed before anything is sent to them. While this process lives, connected or not,
// nobody else commands the arm or takes the scanner.
//
// Failure      one line that names the device and the process that has it
#pragma once

#include "firmware_like/config/config.hpp"
#include "hal/links/claim.hpp"

#include <expected>
#include <string>

namespace moldloft::firmware_like {

struct CellClaim {
  hal::Claim scanner, robot;
};

std::expected<CellClaim, std::string> claim_cell(const CellConfig&);

}  // namespace moldloft::firmware_like
