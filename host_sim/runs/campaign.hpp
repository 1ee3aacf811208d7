// Many simulated runs: shapes x outlines x seeds, one row each, and a summary against the limits that the
// project promises. Two runs at a time, each in a thread of its own; a run's result does not depend on that.
#pragma once

#include "host_sim/cell/cell_description.hpp"

#include <cstdint>
#include <expected>
#include <optional>
#include <string>
#include <string_view>

namespace moldloft::host_sim {

struct SeedRange {
  std::uint64_t first = 1, last = 3;  // both inclusive
};
// "A..B" or "A": at most 10,000 seeds, the first not beyond the last.
std::expected<SeedRange, SimError> seeds_from(std::string_view text);

struct CampaignOptions {
  CellDescription cell;          // what all runs have in common
  std::string plates = "all";    // or one shape's name, or hard (hard_campaign.hpp)
  std::string outlines = "all";  // or one outline's name
  std::optional<SeedRange> seeds;  // 1..3 unless given; of the hard campaign 1..400
  bool json = false;
  std::string out;  // keep the run folders here; empty: they are removed
};

int run_campaign(
    const CampaignOptions&);  // the program's exit code: 0 when every run completed within the limits

}  // namespace moldloft::host_sim
