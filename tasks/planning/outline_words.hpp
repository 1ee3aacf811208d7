// What an operator reads of a plate whose edge is not the outline that was made of it: what it is, how much, where.
//
// Units        mm, world coordinates, plan view
// Allocation   none
// Failure      none
#pragma once

#include "geometry/edges/outline_check.hpp"
#include "hal/base/fixed_text.hpp"
#include "hal/base/realtime.hpp"

namespace moldloft::geometry {
class OutlineSearch;
}

namespace moldloft::tasks {

// "a step of 40 mm inwards over 100 mm of the side at (412, 88)": what was seen. What to do, the caller adds.
hal::Message words_of(const geometry::OutlineDeviation&) MOLDLOFT_NONBLOCKING;

// Why a plate is not measured whose outline is not four-sided: how many corners it has and where, or what is farthest
// off the four sides, and what to do.
hal::Message words_of(const geometry::OutlineSearch&) MOLDLOFT_NONBLOCKING;

}  // namespace moldloft::tasks
