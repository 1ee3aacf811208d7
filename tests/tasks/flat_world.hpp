// A flat plate on a table, seen without noise by a level scanner: enough world to drive the tracker.
#pragma once

#include "hal/scanner/frame.hpp"
#include "tasks/machines/boundary_tracker.hpp"
#include "tasks/slices/shot_view.hpp"

#include <array>
#include <cmath>
#include <functional>
#include <limits>

namespace moldloft::tasks {

struct FlatWorld {
  std::vector<Eigen::Vector2d> outline;  // counter-clockwise, convex
  double plate_z = 6, table_z = 0;
  std::function<bool(const Eigen::Vector2d&)> shape = {};  // instead of the outline

  bool inside(const Eigen::Vector2d& p) const {
    if (shape) return shape(p);
    for (std::size_t i = 0; i < outline.size(); ++i) {
      const Eigen::Vector2d side = outline[(i + 1) % outline.size()] - outline[i], to = p - outline[i];
      if (side.x() * to.y() - side.y() * to.x() < 0) return false;
    }
    return true;
  }

  // Stripes over 102 x 102 mm, in scanner coordinates.
  void expose(const geometry::RigidMotion& world_from_scanner, hal::Frame& frame, std::uint32_t stripes = 100,
              std::uint32_t points = 500) const {
    frame.stripe_count = static_cast<std::uint16_t>(stripes);
    frame.point_count = stripes * points;
    const double height = world_from_scanner.translation().z();
    for (std::uint32_t s = 0; s < stripes; ++s) {
      frame.stripes[s] = {.index = static_cast<std::uint16_t>(s), .first = s * points, .count = points};
      for (std::uint32_t i = 0; i < points; ++i) {
        const double x = -51 + 102.0 * s / (stripes - 1), y = -51 + 102.0 * i / (points - 1);
        const Eigen::Vector3d p = world_from_scanner * Eigen::Vector3d{x, y, 0};
        const std::size_t k = s * points + i;
        frame.x[k] = static_cast<float>(x);
        frame.y[k] = static_cast<float>(y);
        frame.z[k] = static_cast<float>((inside(p.head<2>()) ? plate_z : table_z) - height);
      }
    }
  }
};

// Drives the tracker round a plate until it closes or gives up; returns the last step.
struct Walk {
  BoundaryTracker::Step last;
  int shots = 0, turns = 0;
};
inline Walk walk_round(BoundaryTracker& tracker, const FlatWorld& world, const ShotPlace& start) {
  hal::Frame frame{100, 50000};
  ShotView view{100, 50000, {}};
  Walk walk;
  ShotPlace place = start;
  tracker.begin(start);
  for (; walk.shots < 200;) {
    ++walk.shots;
    const auto motion = geometry::turned_about_z(place.head_yaw, place.centre);
    world.expose(motion, frame);
    const bool seeking = tracker.state() == TrackState::seek_edge;
    view.begin(frame, {.hint = motion.inverse() * tracker.plate_hint(), .reach_mm = seeking ? 60.0 : 18.0});
    while (!view.step()) {
    }
    // Without a table height to tell them apart the higher of the two levels is the plate.
    const double table_z = world.table_z + 1 - place.centre.z();
    const bool on_plate =
        view.found() && frame.z[view.runs().front().first + view.runs().front().stripe * 500u] > table_z;
    walk.last = tracker.take({.world_from_scanner = motion,
                              .plate_found = on_plate,
                              .plate_z_mm = world.plate_z,
                              .view = view.boundary()});
    walk.turns += walk.last.action == TrackAction::turn;
    if (!walk.last.next) break;
    place = *walk.last.next;
  }
  return walk;
}

}  // namespace moldloft::tasks
