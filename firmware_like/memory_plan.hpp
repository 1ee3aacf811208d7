// The memory plan: what the largest plate, the scanner's frames and the net ask for, subsystem by subsystem.
// Printed and stored at start; after start the control thread takes no more.
#pragma once

#include "firmware_like/config.hpp"

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

// The settings of the cell and of its background work that follow from the configuration: how many shots, edge points
// and spans the largest plate can need.
tasks::CellSettings cell_settings(const CellConfig&);
tasks::SurfaceTaskSettings surface_settings(const CellConfig&);

// Of the rings between control thread and disk.
hal::Recorder::Sizes recorder_sizes(const CellConfig&);

}  // namespace moldloft::firmware_like
