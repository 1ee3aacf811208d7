// The controller's configuration for a simulated cell: what the people who set such a cell up would write
// into its cell.toml. They know the arm, the nominal mount and about where a plate is laid; they do not
// know the truth.
#pragma once

#include "firmware_like/config/config.hpp"
#include "host_sim/cell/cell_description.hpp"

#include <expected>
#include <string>

namespace moldloft::host_sim {

struct CellAddresses {
  std::uint16_t scanner_port = hal::psc1::default_port;
  std::string robot_device = "/dev/ttyS0";
  std::uint16_t robot_port = 0;  // not 0: TCP on loopback instead of the device
};

// Whether the file there is one of those, and may be written over.
bool is_generated_cell(const std::string& path);

std::string cell_toml(const CellDescription&, const PlateInstance&, const CellAddresses& = {});

}  // namespace moldloft::host_sim
