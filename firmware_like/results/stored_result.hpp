// The result of a run as its folder holds it: summary.json, surface.json, track.json and timing.json, put together
// again. track.json is where the cell looked and what it saw of the edge: edge points, corners on the way, places of
// all shots; of a run that is complete, the outline's four sides, counter-clockwise from the first corner.
//
//     {"schema":1,"unit":"mm","frame":"world","field":[x,y],"edge_points":[[x,y],..],"corners":[[x,y],..],
//      "boundary_shots":[[x,y,z,yaw_rad],..],"surface_shots":[..],
//      "outline":{"max_mm":m,"corners":[[x,y],..],"sides":[{"degree":3,"knots":[..],"control":[[x,y],..]},..]}}
//
// Blocking     reads four small files
// Failure      one line: which file, and what is wrong with it. A folder without surface.json or track.json is one of
//              a run that did not complete, or of an earlier version: what they would hold stays empty
#pragma once

#include "firmware_like/process/failure.hpp"
#include "firmware_like/results/run_result.hpp"

#include <expected>
#include <filesystem>

namespace moldloft::firmware_like {

Json track_json(const RunResult&);

std::expected<RunResult, Failure> read_result(const std::filesystem::path& folder);

}  // namespace moldloft::firmware_like
