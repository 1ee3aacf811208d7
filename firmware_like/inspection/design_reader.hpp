// A design as it comes: surface.json or design.json, STEP or IGES (by the program moldloft-cad), a list of points, a
// list of template heights, or the folder of an earlier run.
//
// design.json, as moldloft-cad and the simulation write it:
//
//     {"format":"moldloft-design","version":1,"unit":"mm","source":{"file":..},"faces":[
//       {"degree_u":3,"degree_v":3,"knots_u":[..],"knots_v":[..],"control":[[x,y,z],..],"trims":[[[u,v],..],..]}
//     ]}
//
// with the net row by row, u slow and v fast, and the outer loop of the trims first.
//
// Blocking     reads a file; for CAD files runs a program and waits for it
// Failure      one line: which file, what is wrong with it, and what to do
#pragma once

#include "firmware_like/inspection/design.hpp"
#include "firmware_like/process/failure.hpp"
#include "firmware_like/process/json_text.hpp"

#include <expected>
#include <filesystem>

namespace moldloft::firmware_like {

// `unit`: what a person says of points; empty: what the file says.
std::expected<Design, Failure> read_design(const std::filesystem::path&, const std::string& unit);

Json design_json(std::span<const geometry::DesignFace>, const std::string& source);

}  // namespace moldloft::firmware_like
