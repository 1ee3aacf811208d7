// The geometry that runs in the slack of the ticks: outline from the edge points, scan plan, plan map, surface fit. The
// cell asks for the next piece of work and looks now and then whether it is done.
//
// Boundary shots come before the outline is known, so their points cannot be folded into the fit yet. Every
// n-th is kept in a reserve of fixed size. Their number hardly matters, since the robot's error is common to
// all points of a shot.
//
// Thread       the control thread; step() is called by the scheduler in the slack
// Work         step() does one bounded piece: a chunk of points, one pass over a side, one slice of the solution
// Allocation   in the constructor only
// Failure      stage() turns failed and error() says why
#pragma once

#include "geometry/edges/corner_choice.hpp"
#include "geometry/edges/outline.hpp"
#include "geometry/fit/plan_map.hpp"
#include "geometry/fit/surface_fit.hpp"
#include "geometry/rigid_motion.hpp"
#include "hal/base/realtime.hpp"
#include "tasks/planning/scan_plan.hpp"
#include "tasks/scheduler/scheduler.hpp"
#include "tasks/slices/frame_lease.hpp"
#include "tasks/slices/shot_view.hpp"

#include <Eigen/Core>

#include <array>
#include <expected>
#include <memory>
#include <span>
#include <utility>
#include <vector>

namespace moldloft::geometry {
class OutlineSearch;
}

namespace moldloft::tasks {

struct SurfaceTaskSettings {
  geometry::CornerChoiceSettings corners;
  geometry::OutlineSettings outline;
  double edge_limit_mm = 0.5;  // an edge point farther from the outline than this is named
  geometry::SurfaceFitSettings fit;
  std::size_t max_edge_points = 24000;
  std::size_t max_boundary_shots = 96;
  std::size_t reserve_points_per_shot = 3200;  // 50,000 points thinned by 4 x 4
  std::uint32_t reserve_stride = 4;
};

class SurfaceTask final : public BackgroundTask {
 public:
  enum class Stage : std::uint8_t {
    idle,
    building_outline,
    clearing,  // of what the surface before left; the outline is ready
    folding_reserve,
    open,     // takes the next shot
    folding,  // a shot's points; the frame must stay as it is
    solving,
    ready,
    failed,
  };

  explicit SurfaceTask(const SurfaceTaskSettings&);
  ~SurfaceTask() override;

  void begin() MOLDLOFT_NONBLOCKING;
  // Looks at the frame that `shot` has begun; looking() turns false when its view is there. Goes before all
  // other work, except while more of the frame has to arrive.
  void look(ShotView& shot) { looking_at_ = &shot; }
  void stop_looking() { looking_at_ = nullptr; }
  bool looking() const { return looking_at_ != nullptr; }
  // Keeps a thinned copy of the plate's points of a boundary shot; `shot` and its frame stay untouched by others until
  // the lease ends. Goes before the work on the outline.
  void keep(ShotView& shot, const geometry::RigidMotion& world_from_scanner, FrameLease) MOLDLOFT_NONBLOCKING;
  // `corner_candidates`: what the tracker took for corners; more than four is no harm.
  void build_outline(std::span<const Eigen::Vector2d> edges,
                     std::span<const Eigen::Vector2d> corner_candidates) MOLDLOFT_NONBLOCKING;
  // Plans which shots cover the outline, which is ready; planning() turns false when it is done. Goes before the fit.
  void plan(ZigzagPlan& zigzag) { planning_ = &zigzag; }
  bool planning() const { return planning_ != nullptr; }
  // Folds a surface shot in; `shot` and its frame stay untouched by others until the lease ends. The stage is open, or
  // failed: then the shot is dropped.
  void fold(ShotView& shot, const geometry::RigidMotion& world_from_scanner, FrameLease) MOLDLOFT_NONBLOCKING;
  void solve() MOLDLOFT_NONBLOCKING;

  bool has_work() const override;
  void step(Instant deadline) override;
  std::size_t next_kind() const override {
    return can_look() ? std::to_underlying(looking_at_->next_kind()) : 0;
  }

  Stage stage() const { return stage_; }
  // The outline is there, but the surface takes no shot yet. A shot exposed now might come too early.
  bool prepares() const { return stage_ == Stage::clearing || stage_ == Stage::folding_reserve; }
  bool outline_ready() const { return stage_ >= Stage::clearing && stage_ != Stage::failed; }
  geometry::Error error() const { return error_; }
  const geometry::Outline& outline() const MOLDLOFT_NONBLOCKING;
  // After Error::not_four_sided: what was found instead.
  const geometry::OutlineSearch& outline_search() const { return *outline_; }
  const geometry::SurfaceFit& fit() const { return fit_; }
  int shots() const { return shots_; }
  double progress() const { return fit_.progress(); }

  std::size_t outline_bytes() const;
  std::size_t fit_bytes() const { return fit_.bytes(); }
  std::size_t reserve_bytes() const { return reserve_.capacity() * sizeof(Eigen::Vector3d); }
  std::size_t reserve_used_bytes() const { return reserve_.size() * sizeof(Eigen::Vector3d); }

 private:
  // A point costs 0.1 us in all, 2 us on a processor of 500 million instructions a second; a point that is kept a
  // quarter of it.
  static constexpr std::size_t chunk_points = 88, kept_points = 320;

  bool keeping() const MOLDLOFT_NONBLOCKING { return keeping_from_ != nullptr; }
  bool can_look() const MOLDLOFT_NONBLOCKING { return looking() && !looking_at_->waits(); }
  void fail(geometry::Error error);
  void step_keep() MOLDLOFT_NONBLOCKING;
  void step_outline();
  void step_reserve();
  void step_fold();
  void step_solve();

  SurfaceTaskSettings settings_;
  std::unique_ptr<geometry::OutlineSearch> outline_;
  geometry::PlanMap map_;
  geometry::SurfaceFit fit_;
  std::span<const Eigen::Vector2d> edges_;
  std::vector<Eigen::Vector3d> reserve_;
  std::vector<std::size_t> reserve_ends_;  // one past each boundary shot's points
  std::array<Eigen::Vector3d, chunk_points> chunk_;
  Stage stage_ = Stage::idle;
  geometry::Error error_{};
  std::size_t reserve_next_ = 0, reserve_shot_ = 0;
  ShotView* shot_ = nullptr;
  ShotView* looking_at_ = nullptr;
  ShotView* keeping_from_ = nullptr;
  ZigzagPlan* planning_ = nullptr;
  FrameLease kept_, folded_;  // of the frames of keeping_from_ and shot_
  std::size_t keep_end_ = 0;  // of the reserve, for the shot at hand
  int map_row_ = -1;          // of the plan map's check; -1: the outline is not there yet
  geometry::RigidMotion world_from_scanner_;
  int shots_ = 0;
};

}  // namespace moldloft::tasks
