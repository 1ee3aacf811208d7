// The settings of a cell, given once before it starts. Lengths in mm, angles in rad.
#pragma once

#include "geometry/rigid_motion.hpp"
#include "hal/base/clock.hpp"
#include "tasks/cell/motion_guard.hpp"
#include "tasks/machines/boundary_tracker.hpp"
#include "tasks/planning/scan_plan.hpp"
#include "tasks/slices/shot_view.hpp"

#include <cstddef>
#include <cstdint>

namespace moldloft::tasks {

struct CellSettings {
  geometry::RigidMotion tip_from_scanner = geometry::RigidMotion::Identity();
  ShotPlace start;
  int speed_percent = 100;
  Workspace workspace;
  TrackerSettings tracker;
  ScanPlanSettings scan;
  ShotViewSettings view;
  std::size_t max_stripes = 128, max_points = 65536;  // of a frame
  std::size_t max_surface_shots = 64;
  double depth_mm = 60;             // the scanner's, to each side: how far off in height the start may be
  double lowest_plate_z_mm = -1e9;  // what lies lower is the table
  int max_attempts = 3;             // of one shot, before the cell holds
  hal::Duration device_timeout =
      std::chrono::seconds{10};                       // for scanner and robot to become ready at the start
  hal::Duration scanner_wait = hal::Duration::max();  // for one that is lost; then a person is waited for
  hal::Duration disk_wait = hal::Duration::max();     // likewise for one that is full or hangs
  Arrival arrival;
  std::uint32_t epoch = 1;  // of this run's shot ids (shot_archive.hpp)
  bool devices = true;      // false: only archived shots, nothing moves
};

}  // namespace moldloft::tasks
