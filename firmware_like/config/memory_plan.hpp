// The memory plan: what the largest plate, the scanner's frames and the net need, subsystem by subsystem.
// Printed and stored at start; after start the control thread takes no more.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace moldloft::firmware_like {

struct MemoryItem {
  std::string subsystem;
  std::size_t plan_bytes = 0;
  std::size_t high_water_bytes = 0;
};

using MemoryPlan = std::vector<MemoryItem>;

std::size_t total_plan(const MemoryPlan&);
std::size_t total_high_water(const MemoryPlan&);

}  // namespace moldloft::firmware_like
