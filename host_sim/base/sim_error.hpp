// What can go wrong when a simulated cell is set up: one line for a person that names what, where and
// what to do.
#pragma once

#include <string>

namespace moldloft::host_sim {

struct SimError {
  std::string what;
};

}  // namespace moldloft::host_sim
