// A formed plate with an outline of its own, and holes: the surface of one plate, the rim of another.
//
// The outline must lie where the base plate's surface is defined; the formulas are defined everywhere. Holes are
// polygons inside the outline, counter-clockwise as it is. Corners are those of the largest quadrilateral that
// the outline holds.
#pragma once

#include "host_sim/plates/plate.hpp"

#include <memory>
#include <string>
#include <vector>

namespace moldloft::host_sim {

std::shared_ptr<const Plate> make_cut_plate(std::string name, std::shared_ptr<const Plate> base,
                                            std::vector<Eigen::Vector2d> outline,
                                            const std::vector<std::vector<Eigen::Vector2d>>& holes = {});

}  // namespace moldloft::host_sim
