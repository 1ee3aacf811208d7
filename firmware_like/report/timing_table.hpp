// timing.json for people at a terminal: plain, aligned, at most 100 columns.
//
// Thread       any
// Allocation   yes
// Failure      throws Json::exception where a report lacks what every report has: one of another version
#pragma once

#include "firmware_like/process/json_text.hpp"

#include <string>

namespace moldloft::firmware_like {

std::string timing_table(const Json& timing);  // everything
std::string timing_lines(const Json& timing);  // what one wants to know at the end of a run
// How many ticks were missed, why, and where it began; empty where none was.
std::string missed_ticks_line(const Json& timing);
// What was lost of the devices' words, "robot: garbled lines 3, repeated lines 1"; empty where nothing was.
std::string losses_line(const Json& timing);

}  // namespace moldloft::firmware_like
