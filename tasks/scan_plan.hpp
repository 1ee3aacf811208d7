// The zig-zag: which shots cover the plate. The outline's bounding box, turned to the plate so that its area
// is least, is cut into rows; each row holds as many shots as the outline is long there; every other row runs
// backwards (thesis section 5.3.3, without its assumption that the plate lies along the axes).
//
// Frame        world, plan view, mm; the centre's height comes from the height model
// Allocation   none: shots go into the caller's array
// Failure      geometry::Error::capacity when the plate needs more shots than the array holds
#pragma once

#include <expected>
#include <span>

#include "geometry/edges/outline.hpp"
#include "geometry/error.hpp"
#include "hal/realtime.hpp"
#include "tasks/boundary_tracker.hpp"
#include "tasks/height_model.hpp"

namespace moldloft::tasks {

struct ScanPlanSettings {
  double field_x_mm = 102, field_y_mm = 102;
  double overlap_mm = 10;  // of neighbouring fields; also what perspective and robot errors may eat
  double margin_mm = 2;    // of the field beyond the outline
};

// Fills `places` in the order of travel, beginning at the corner of the box nearest to `from`; returns how many.
// `head_yaw_now` picks between yaws that differ by half a turn.
std::expected<std::size_t, geometry::Error> plan_zigzag(const geometry::Outline& outline,
                                                        const HeightModel& heights,
                                                        const ScanPlanSettings& settings,
                                                        const Eigen::Vector2d& from, double head_yaw_now,
                                                        std::span<ShotPlace> places) MOLDLOFT_NONBLOCKING;

}  // namespace moldloft::tasks
