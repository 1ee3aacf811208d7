// Many simulated runs: shapes x outlines x seeds, one row each, and a summary against the limits that the
// project promises. Two runs at a time, each in a thread of its own; a run's result does not depend on that.
#pragma once

#include <cstdint>
#include <string>

#include "host_sim/cell_description.hpp"

namespace moldloft::host_sim {

struct CampaignOptions {
  CellDescription cell;          // what all runs have in common
  std::string plates = "all";    // or one shape's name
  std::string outlines = "all";  // or one outline's name
  std::string seeds = "1..3";    // A..B or A
  bool json = false;
  std::string out;  // keep the run folders here; empty: they are removed
};

int run_campaign(
    const CampaignOptions&);  // the program's exit code: 0 when every run completed within the limits

}  // namespace moldloft::host_sim
