// How long a run still takes, from the first shot on the plate's edge on. Until the zig-zag is planned it is
// an estimate, then the remaining shots at the pace of those before.
//
// The tracker walks once round a point that lies on the plate. The angle that it has swept about that point
// tells how much of the outline is done; the area that it has swept tells how much of the plate. The first
// shots say little about that. Until there are more, the plate is taken for a square about the start. Its
// size lies between the usual one and the one that the first edge's distance suggests. The pace counts what
// was measured now: time in a hold, and shots of an earlier run, do not.
//
// Thread       one thread
// Blocking     never
// Allocation   none
#pragma once

#include "hal/base/realtime.hpp"
#include "hal/record/run_record.hpp"
#include "tasks/machines/boundary_tracker.hpp"
#include "tasks/planning/scan_plan.hpp"

#include <Eigen/Core>

#include <cstddef>

namespace moldloft::tasks {

class TimeLeft {
 public:
  TimeLeft(const TrackerSettings&, const ScanPlanSettings&);

  void begin(const Eigen::Vector2d& on_plate) MOLDLOFT_NONBLOCKING;

  struct Shot {
    hal::ShotPurpose purpose{};
    Eigen::Vector2d centre;     // of its field of view, world, mm
    hal::Duration spent{0};     // on measuring, since begin(), holds left out
    bool from_archive = false;  // it took no time in this run
  };
  void took(const Shot&) MOLDLOFT_NONBLOCKING;
  void edge_is_found() MOLDLOFT_NONBLOCKING { edge_found_ = true; }  // by the last shot
  void boundary_is_closed() MOLDLOFT_NONBLOCKING { closed_ = true; }
  void planned(std::size_t surface_shots) MOLDLOFT_NONBLOCKING {
    planned_ = static_cast<double>(surface_shots);
  }

  // Negative while it is not known.
  hal::Duration left(hal::Duration spent) const MOLDLOFT_NONBLOCKING;
  bool is_planned() const MOLDLOFT_NONBLOCKING { return planned_ >= 0; }

 private:
  double outline_done() const MOLDLOFT_NONBLOCKING;  // 0..1
  double guessed_side() const MOLDLOFT_NONBLOCKING;  // mm
  double in_all(double seen, double guess) const MOLDLOFT_NONBLOCKING;
  double perimeter() const MOLDLOFT_NONBLOCKING;       // mm
  double boundary_shots() const MOLDLOFT_NONBLOCKING;  // in all, as far as one knows
  double surface_shots() const MOLDLOFT_NONBLOCKING;

  double field_mm_;
  ScanPlanSettings scan_;
  Eigen::Vector2d on_plate_{0, 0}, first_{0, 0}, last_{0, 0};
  double swept_ = 0, swept_mm2_ = 0, walked_mm_ = 0;
  double boundary_ = 0, surface_ = 0;             // shots so far, of whatever run
  double taken_now_ = 0, surface_taken_now_ = 0;  // shots that took time
  double planned_ = -1;
  hal::Duration last_spent_{0}, surface_from_{-1};
  bool edge_found_ = false, closed_ = false;
};

}  // namespace moldloft::tasks
