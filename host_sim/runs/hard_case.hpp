// The hard campaign's cases: what a seed asks of the cell, and what is wrong with it, known beforehand. A plate that is
// steep, tall, tiny or not four-sided; a device that lies; a plate that is moved; a configuration that is not true.
//
// Thread       any; pure: a seed means the same case everywhere
#pragma once

#include "host_sim/cell/cell_description.hpp"

#include <span>
#include <string>
#include <string_view>

namespace moldloft::host_sim {

// What is known to be wrong, and the words by which whoever warns or holds names it: one of them must stand in what is
// said. Words without a cause (a sound plate): none is true.
struct Cause {
  std::string_view name;
  std::span<const std::string_view> words;
};
std::span<const Cause> hard_causes();

struct HardCase {
  const Cause* cause = nullptr;
  std::string what;  // this case: "ragged, teeth of 8.2 mm", "robot-lies 5 at 7"
  CellDescription cell;
};
HardCase hard_case(std::uint64_t seed);

// Whether what was said names the cause, in whatever case its letters are.
bool names(const Cause&, std::string_view said);

}  // namespace moldloft::host_sim
