#include "firmware_like/config/cell_settings.hpp"

#include "firmware_like/config/device_makes.hpp"
#include "geometry/edges/outline_check.hpp"
#include "tasks/planning/tool_pose.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

namespace moldloft::firmware_like {
namespace {

// Turned heads, retakes and corners cost shots beyond what the perimeter asks for.
constexpr double spare_boundary_shots = 1.5;
constexpr int few_shots = 16;

// Turned heads, half steps and other heights while the edge is sought.
constexpr int spare_seek_shots = 16;

// Of the depth range: how far a plate that is not seen is sought higher or lower. The rest is overlap.
constexpr double storey_share = 1.6;

// Heartbeats and answers that come between the frames.
constexpr std::size_t spare_bytes = 4096;

double smaller_field(const CellConfig& c) { return std::min(c.scanner.field_x_mm, c.scanner.field_y_mm); }

int boundary_shots(const CellConfig& c) {
  const double perimeter = 2 * (c.plate.largest_x_mm + c.plate.largest_y_mm);
  const double progress = std::max(smaller_field(c) - c.tracking_overlap_mm, 0.25 * smaller_field(c));
  return static_cast<int>(std::ceil(spare_boundary_shots * perimeter / progress)) + few_shots;
}

int surface_shots(const CellConfig& c) {
  const auto along = [&](double length) {
    return std::ceil((length + 2 * c.scan_margin_mm) / (smaller_field(c) - c.scan_overlap_mm)) + 1;
  };
  // A plate lies as it lies: its box is no larger than the largest plate's, its rows no longer.
  return static_cast<int>(along(c.plate.largest_x_mm) * along(c.plate.largest_y_mm)) + few_shots;
}

// A power of two, no span shorter than asked for.
int finest_spans(double length_mm, double span_mm) {
  const auto wanted = static_cast<unsigned>(std::max(length_mm / span_mm, 1.0));
  return static_cast<int>(std::clamp<unsigned>(std::bit_floor(wanted), geometry::fewest_finest_spans,
                                               geometry::most_finest_spans));
}

}  // namespace

tasks::CellSettings cell_settings(const CellConfig& c) {
  tasks::CellSettings s;
  const double half_x = c.scanner.field_x_mm / 2, half_y = c.scanner.field_y_mm / 2;
  const double pitch = c.scanner.field_x_mm / std::max(c.scanner.max_stripes - 1, 1);
  s.tip_from_scanner = c.scanner.tip_from_scanner;
  s.start = c.start;
  s.speed_percent = c.robot.speed_percent;
  s.workspace = c.robot.workspace;
  s.device_timeout = c.device_timeout;
  s.scanner_wait = c.scanner_wait;
  s.disk_wait = c.disk_wait;
  s.arrival = c.robot.arrival;
  s.max_stripes = static_cast<std::size_t>(c.scanner.max_stripes);
  s.max_points = s.max_stripes * static_cast<std::size_t>(c.scanner.max_points_per_stripe);
  s.depth_mm = c.scanner.depth_mm;
  s.lowest_plate_z_mm = c.plate.table_z_mm + c.plate.thickness_mm / 2;
  s.max_surface_shots = static_cast<std::size_t>(surface_shots(c));

  s.tracker.field_half_x_mm = half_x;
  s.tracker.field_half_y_mm = half_y;
  s.tracker.overlap_mm = c.tracking_overlap_mm;
  s.tracker.crossing = c.tracking_crossing_deg * hal::degree;
  s.tracker.seek_step_mm = c.seek_step_mm;
  s.tracker.max_seek_steps = static_cast<int>(c.seek_limit_mm / c.seek_step_mm);
  // The tip's heights are the workspace's; the field's centre lies where the mount puts it.
  const double tip_over_field = tasks::tip_pose_for({}, c.scanner.tip_from_scanner).z_mm;
  s.tracker.lowest_z_mm = c.robot.workspace.z_mm.min - tip_over_field;
  s.tracker.highest_z_mm = c.robot.workspace.z_mm.max - tip_over_field;
  s.tracker.storey_mm = storey_share * c.scanner.depth_mm;
  s.tracker.max_shots = boundary_shots(c) + s.tracker.max_seek_steps + spare_seek_shots;
  s.tracker.max_edge_points = static_cast<std::size_t>(boundary_shots(c)) * 2 * s.max_stripes;

  s.scan = {.field_x_mm = c.scanner.field_x_mm,
            .field_y_mm = c.scanner.field_y_mm,
            .overlap_mm = c.scan_overlap_mm,
            .margin_mm = c.scan_margin_mm};

  s.view.runs.noise_mm = c.scanner.noise_mm;
  s.view.runs.min_step_mm = c.plate.thickness_mm / 4;
  s.view.runs.field_half_y_mm = half_y;
  s.view.runs.depth_mm = c.scanner.depth_mm;
  s.view.boundary.stripe_pitch_mm = pitch;
  s.view.boundary.field_half_x_mm = half_x;
  s.view.boundary.field_half_y_mm = half_y;
  return s;
}

hal::Recorder::Sizes recorder_sizes(const CellConfig& c) {
  hal::Recorder::Sizes sizes;
  sizes.largest_frame_bytes = make_of(c.scanner).largest_frame_bytes(c.scanner) + spare_bytes;
  // Four frames: a disk may stand still for three shots before the cell has to wait for it.
  sizes.bulk_bytes = 4 * (sizes.largest_frame_bytes + sizes.largest_frame_bytes / 16);
  return sizes;
}

tasks::SurfaceTaskSettings surface_settings(const CellConfig& c) {
  const tasks::CellSettings cell = cell_settings(c);
  tasks::SurfaceTaskSettings s;
  s.max_edge_points = cell.tracker.max_edge_points;
  s.edge_limit_mm = geometry::outline_limit_mm(c.scanner.noise_mm);
  s.corners.max_candidates = static_cast<std::size_t>(cell.tracker.max_shots);
  s.max_boundary_shots = static_cast<std::size_t>(cell.tracker.max_shots) + 1;
  s.reserve_points_per_shot =
      (cell.max_points + s.reserve_stride * s.reserve_stride - 1) / (s.reserve_stride * s.reserve_stride) +
      cell.max_stripes;
  const double longer = std::max(c.plate.largest_x_mm, c.plate.largest_y_mm);
  const double shorter = std::min(c.plate.largest_x_mm, c.plate.largest_y_mm);
  s.fit.max_spans_u = finest_spans(longer, c.finest_span_mm);
  s.fit.max_spans_v = finest_spans(shorter, c.finest_span_mm);
  s.fit.finest_span_mm = c.finest_span_mm;
  s.fit.max_shots = static_cast<int>(s.max_boundary_shots + cell.max_surface_shots);
  s.fit.tolerance_mm = c.fit_tolerance_mm;
  s.fit.shot_sigma_mm = c.robot.repeatability_z_mm;
  return s;
}

}  // namespace moldloft::firmware_like
