// The measurement: what happens inside Execute, phase by phase. The table is phases.hpp; this class carries its actions
// out. It orders shots, looks at their frames, and gives what they show to the tracker and to the background work.
//
// Frames       world for places and heights; the frames are the scanner's and are registered with the shot's pose
// Thread       the control thread
// Blocking     never; the background work does what takes longer than a tick
// Allocation   in the constructor only
// Failure      a plate that cannot be measured, or outgrows the memory plan, holds the cell with the reason
#pragma once

#include "hal/base/realtime.hpp"
#include "tasks/cell/cell_settings.hpp"
#include "tasks/cell/shot_evidence.hpp"
#include "tasks/cell/shot_taker.hpp"
#include "tasks/cell/supervisor.hpp"
#include "tasks/cell/time_left.hpp"
#include "tasks/machines/boundary_tracker.hpp"
#include "tasks/machines/phases.hpp"
#include "tasks/planning/height_model.hpp"
#include "tasks/planning/scan_plan.hpp"
#include "tasks/slices/frame_health.hpp"
#include "tasks/slices/frame_lease.hpp"
#include "tasks/slices/shot_view.hpp"
#include "tasks/slices/surface_task.hpp"

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace moldloft::tasks {

class Measurement final : public ShotUser {
 public:
  Measurement(const CellSettings&, Supervisor&, SurfaceTask&, ShotTaker&);
  ~Measurement();
  Measurement(const Measurement&) = delete;
  Measurement& operator=(const Measurement&) = delete;

  void begin() MOLDLOFT_NONBLOCKING;  // Execute is entered for the first time in a run
  void step() MOLDLOFT_NONBLOCKING;   // once a tick in Execute; says done when the surface is there
  void use_view()
      MOLDLOFT_NONBLOCKING;  // once a tick in any state: uses a whole frame that has been looked at
  void spend(hal::Duration in_execute) MOLDLOFT_NONBLOCKING { spent_ += in_execute; }
  void frame_is_lost() MOLDLOFT_NONBLOCKING;  // the one that arrives will not become whole
  void forget() MOLDLOFT_NONBLOCKING;

  // ---- ShotUser
  bool takes_frame() const MOLDLOFT_NONBLOCKING override;
  void frame_comes(const ShotOrder&, const hal::Frame&, hal::Scanner* unpacks) MOLDLOFT_NONBLOCKING override;
  void frame_is_whole(const ShotOrder&, const hal::Frame&, hal::Scanner* unpacks,
                      bool of_earlier_run) MOLDLOFT_NONBLOCKING override;
  void arm_is_free() MOLDLOFT_NONBLOCKING override;
  bool visit_again(const ShotPlace&) MOLDLOFT_NONBLOCKING override;

  // ---- where it stands
  Phase phase() const MOLDLOFT_NONBLOCKING { return phase_; }
  int shots_taken(hal::ShotPurpose purpose) const MOLDLOFT_NONBLOCKING {
    return taken_[static_cast<std::size_t>(purpose)];
  }
  double part_done() const MOLDLOFT_NONBLOCKING;  // of the phase, 0..1
  struct Left {
    hal::Duration time{-1};  // negative: not known yet
    bool is_planned = false;
  };
  Left left() MOLDLOFT_NONBLOCKING;

  // ---- results
  const BoundaryTracker& tracker() const { return tracker_; }
  std::span<const ShotPlace> boundary_places() const { return boundary_places_; }
  std::span<const ShotPlace> surface_places() const MOLDLOFT_NONBLOCKING {
    return {surface_places_.data(), surface_planned_};
  }
  const RunEvidence& evidence() const { return evidence_.evidence(); }
  std::uint64_t points_seen() const { return points_seen_; }
  hal::Instant surface_ready() const { return surface_ready_; }
  std::size_t plan_bytes() const;

 private:
  void apply(PhaseEvent, const PhaseContext& = {}) MOLDLOFT_NONBLOCKING;
  void carry_out(PhaseAction) MOLDLOFT_NONBLOCKING;
  void seek() MOLDLOFT_NONBLOCKING;
  void build_outline() MOLDLOFT_NONBLOCKING;
  void plan_zigzag() MOLDLOFT_NONBLOCKING;
  void scan() MOLDLOFT_NONBLOCKING;
  void order_next() MOLDLOFT_NONBLOCKING;
  void hold_for_flaw(HoldCause) MOLDLOFT_NONBLOCKING;
  void use_shot(FrameLease) MOLDLOFT_NONBLOCKING;
  bool is_of_a_sound_scanner() MOLDLOFT_NONBLOCKING;
  void hold_for_plate(HoldCause, const hal::Message&) MOLDLOFT_NONBLOCKING;
  void keep_evidence(const geometry::RigidMotion& world_from_scanner, bool plate_found) MOLDLOFT_NONBLOCKING;
  std::optional<double> learn_heights(const geometry::RigidMotion& world_from_scanner) MOLDLOFT_NONBLOCKING;
  void track(const ShotOrder&, const geometry::RigidMotion& world_from_scanner,
             std::optional<double> plate_z_mm) MOLDLOFT_NONBLOCKING;
  Eigen::Vector3d hint_in_world(const ShotOrder&) const MOLDLOFT_NONBLOCKING;
  std::optional<Eigen::Vector3d> known_in_field(const ShotPlace&, double times) const MOLDLOFT_NONBLOCKING;
  ShotPlace raised_to_plate(ShotPlace) const MOLDLOFT_NONBLOCKING;
  void look_again_where_plate_is() MOLDLOFT_NONBLOCKING;
  int visits_of(const ShotPlace&) const MOLDLOFT_NONBLOCKING;

  const CellSettings& settings_;
  Supervisor& supervisor_;
  SurfaceTask& surface_;
  ShotTaker& shots_;

  Phase phase_ = Phase::none;
  FrameLender frame_;
  FrameLease look_;  // held while the background work looks at a frame, and until its view has been used
  ShotOrder looked_at_;
  bool accepted_ = false;  // the frame that is looked at is whole
  BoundaryTracker tracker_;
  ShotView view_;
  HeightModel heights_;
  EvidenceBook evidence_;
  std::vector<ShotPlace> boundary_places_, surface_places_;
  std::size_t surface_planned_ = 0, surface_next_ = 0;
  ZigzagPlan zigzag_;
  bool plan_begun_ = false;  // the zig-zag's
  FrameHealth health_;       // of the last frame
  FrameHealth last_seen_;    // of the last that was not blind
  bool has_seen_ = false;    // points, in any frame of the run
  std::array<int, 3> taken_{};
  std::uint64_t points_seen_ = 0;
  TimeLeft time_left_;
  hal::Duration spent_{0};  // in Execute, since begin()
  hal::Instant surface_ready_{0};
};

}  // namespace moldloft::tasks
