// What every shot of a run showed, thinned: enough to ask afterwards whether the result can be true. Of each shot its
// place and pose, whether the plate was found, the runs of some forty stripes with their ends, and a lattice of points.
//
// Kept by the cell while it measures: the shot before knows best how high the plate lies where the next one looks. The
// audit reads a copy (firmware_like/results/audit.hpp).
//
// Frame        world, mm
// Thread       the control thread; a copy may be read by anybody
// Cost         add() about 10 us; known_near() 5 us
// Memory       7 kB a shot, all of it allocated in the constructor
// Failure      a shot beyond the memory plan is not kept; the cell gives up before
#pragma once

#include "geometry/rigid_motion.hpp"
#include "hal/base/realtime.hpp"
#include "hal/record/run_record.hpp"
#include "tasks/machines/boundary_tracker.hpp"
#include "tasks/slices/shot_view.hpp"

#include <Eigen/Core>

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace moldloft::tasks {

enum class RunEdge : std::uint8_t {
  none,          // the plate goes on beyond the field, or is hidden
  edge,          // the plate ends here
  out_of_depth,  // the plate leaves the depth range that the scanner measures
};

struct SeenRun {  // of one stripe
  Eigen::Vector3d first, last;
  RunEdge at_first = RunEdge::none, at_last = RunEdge::none;
};

struct ShotSeen {
  std::uint32_t number = 0;  // in the run, from 1
  hal::ShotPurpose purpose{};
  ShotPlace place;
  geometry::RigidMotion world_from_scanner = geometry::RigidMotion::Identity();
  bool plate_found = false;
  std::uint32_t runs_end = 0, samples_end = 0;  // one past the shot's own in the lists below
};

struct RunEvidence {
  std::vector<ShotSeen> shots;
  std::vector<SeenRun> runs;
  std::vector<Eigen::Vector3d> samples;  // on the plate, away from its edges

  std::span<const SeenRun> runs_of(std::size_t shot) const MOLDLOFT_NONBLOCKING;
  std::span<const Eigen::Vector3d> samples_of(std::size_t shot) const MOLDLOFT_NONBLOCKING;
};

class EvidenceBook {
 public:
  struct Settings {
    std::size_t max_shots = 0;
    double field_x_mm = 102, field_y_mm = 102;  // of the scanner
  };
  explicit EvidenceBook(const Settings&);

  void begin() MOLDLOFT_NONBLOCKING;
  // The shot that `view` has looked at; its walk over points is used up.
  void add(const ShotSeen& shot, ShotView& view) MOLDLOFT_NONBLOCKING;

  // The known point of the plate that is nearest to the centre of a field and lies in it.
  std::optional<Eigen::Vector3d> known_near(const ShotPlace&, double field_half_x_mm,
                                            double field_half_y_mm) const MOLDLOFT_NONBLOCKING;
  // Of the last shot: how many stripes leave the depth range upwards and downwards.
  struct OutOfDepth {
    int above = 0, below = 0, runs = 0;
  };
  OutOfDepth last_out_of_depth() const MOLDLOFT_NONBLOCKING;

  const RunEvidence& evidence() const MOLDLOFT_NONBLOCKING { return kept_; }
  std::size_t bytes() const;

 private:
  static constexpr std::size_t stripes_a_shot = 40, runs_a_shot = 64;
  static constexpr std::size_t samples_across = 11, samples_a_shot = 128;
  void add_runs(const geometry::RigidMotion& world_from_scanner, const ShotView&) MOLDLOFT_NONBLOCKING;
  void add_samples(const geometry::RigidMotion& world_from_scanner, ShotView&) MOLDLOFT_NONBLOCKING;
  static RunEdge edge_at(geometry::RunEnd) MOLDLOFT_NONBLOCKING;

  double field_reach_mm_;  // from its centre to its corner
  RunEvidence kept_;
};

}  // namespace moldloft::tasks
