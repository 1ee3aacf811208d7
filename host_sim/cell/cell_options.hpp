// The options by which every command of moldloft-sim describes its cell. They bind to a CellDescription that
// must outlive the parsing.
#pragma once

#include "host_sim/cell/cell_description.hpp"

#include <CLI/CLI.hpp>

namespace moldloft::host_sim {

void add_cell_options(CLI::App& command, CellDescription& cell);
// --fault, which may be given several times, for the commands that have devices to be wrong.
void add_fault_option(CLI::App& command, CellDescription& cell);

}  // namespace moldloft::host_sim
