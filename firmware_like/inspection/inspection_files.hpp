// What an inspection leaves in the run's folder.
//
//     inspection.json   all of the result but the single points
//     deviations.csv    a line for each place of the map, or each point of the design
//     deviations.ply    the single measured points, coloured by viewers through `quality` and `scalar_deviation`
//     frames.txt        measured less designed heights: a template list in the shape in which it came, else a table
//
// Thread       any; pure
#pragma once

#include "firmware_like/inspection/inspection.hpp"
#include "firmware_like/process/json_text.hpp"

#include <string>

namespace moldloft::firmware_like {

Json inspection_json(const Inspection&);
std::string deviations_csv(const Inspection&);
std::string deviations_ply(const Inspection&);
std::string frames_text(const Inspection&, const Design&);

// For a person at a terminal: verdict first.
std::string inspection_table(const Inspection&);

}  // namespace moldloft::firmware_like
