// surface.json: the measured surface as a run leaves it, written and read back without losing a bit.
//
//     {"schema":1,"unit":"mm","frame":"world","degree":[3,3],"knots_u":[..],"knots_v":[..],"control":[[[x,y,z],..],..]}
//
// with the net row by row along u.
//
// Blocking     read_surface reads a file
// Failure      one line: which file, and what is wrong with it
#pragma once

#include "firmware_like/process/failure.hpp"
#include "firmware_like/process/json_text.hpp"
#include "geometry/splines/bspline.hpp"

#include <expected>
#include <filesystem>

namespace moldloft::firmware_like {

Json surface_json(const geometry::BSplineSurface&);
std::expected<geometry::BSplineSurface, Failure> read_surface(const std::filesystem::path&);

}  // namespace moldloft::firmware_like
