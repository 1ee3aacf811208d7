// What an operator reads when the geometry finds no outline or no surface: what was seen, where, and what to do. The
// geometry's own words are for who writes programs with it; none of them reaches a person at the cell.
//
// Units        mm, world coordinates, plan view
// Allocation   none
// Failure      none
#pragma once

#include "geometry/error.hpp"
#include "hal/base/fixed_text.hpp"
#include "hal/base/realtime.hpp"

#include <Eigen/Core>

#include <span>

namespace moldloft::geometry {
class OutlineSearch;
}

namespace moldloft::tasks {

// `edge_points`: all that the tracker saw of the plate's edge.
hal::Message flaw_words(geometry::Error, const geometry::OutlineSearch&,
                        std::span<const Eigen::Vector2d> edge_points) MOLDLOFT_NONBLOCKING;

}  // namespace moldloft::tasks
