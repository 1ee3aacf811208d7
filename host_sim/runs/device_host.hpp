// The simulated devices in real time: the scanner on a loopback TCP port, the robot on a pseudo-terminal or on a
// serial port of the machine's own, for a controller that cannot tell them from real ones.
#pragma once

#include "host_sim/cell/cell_description.hpp"

#include <optional>
#include <string>

namespace moldloft::host_sim {

struct DeviceOptions {
  CellDescription cell;
  std::uint16_t scanner_port = hal::psc1::default_port;  // 0: any that is free
  std::string robot_pty = "/tmp/moldloft-robot";
  std::string robot_serial;  // a serial port instead of the pseudo-terminal; empty: none
  std::string controller_serial =
      "/dev/ttyS0";                         // the controller's port, at the other end of that one's cable
  std::optional<std::uint16_t> robot_port;  // TCP on loopback instead of both; 0: any that is free
  bool log = false;                         // a line for each motion that begins and ends and each exposure
  std::string cell_toml;  // where to write a configuration that fits these devices; empty: nowhere
  bool force = false;     // even over a file that this program has not written
};

// Prints one line when both devices can be reached, serves until SIGINT or SIGTERM, and lets clients come and
// go. Returns the program's exit code; a failure has been printed in one line.
int run_devices(const DeviceOptions&);

}  // namespace moldloft::host_sim
