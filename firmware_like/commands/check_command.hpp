// `moldloft check`: all that can be known of a cell before a plate is measured. It lists everything wrong
// with the configuration at once, what this machine lacks, the memory plan, the limits and the real-time
// set-up. With --connect it asks the devices as well. The value returned is the program's exit code: 0 where
// a run could begin, 1 otherwise; warnings change nothing.
#pragma once

#include <string>

namespace moldloft::firmware_like {

struct CheckOptions {
  std::string config;    // the cell's configuration
  bool connect = false;  // ask the devices
};
int check_cell(const CheckOptions&);

}  // namespace moldloft::firmware_like
