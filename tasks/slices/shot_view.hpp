// What the cell makes of a frame: the plate's runs, the boundary's pieces, the points that lie on the plate.
//
// Frame        scanner coordinates in, scanner coordinates out; the caller registers with the shot's pose
// Cost         0.7 ms for 100 stripes of 500 points, in pieces of 10 us, or of 0.2 ms on a processor of 500 million
//              instructions a second
// Allocation   in the constructor only
#pragma once

#include "geometry/edges/boundary_view.hpp"
#include "geometry/edges/plate_runs.hpp"
#include "hal/base/realtime.hpp"
#include "hal/scanner/scanner.hpp"

#include <optional>
#include <vector>

namespace moldloft::tasks {

struct ShotViewSettings {
  geometry::PlateRunSettings runs;
  geometry::BoundaryViewSettings boundary;
  double edge_margin_mm =
      1.5;                    // points nearer than this to an edge, along the stripe, stay out of the surface
  double outlier_sigmas = 6;  // a point this far from the median of its neighbours stays out as well
};

class ShotView {
 public:
  ShotView(std::size_t max_stripes, std::size_t max_points, const ShotViewSettings&);

  struct Request {
    Eigen::Vector3d hint{0, 0, 0};  // a point on the plate ...
    double reach_mm = 0;            // ... good to this
    bool boundary = true;           // false: only the points on the plate are wanted
  };
  // Looks at a frame, which must stay as it is. `unpacks`, when given, holds points of it that are still packed or
  // have still to arrive. In bounded pieces: begin(), then step() until it says true, then found() and the rest
  // may be asked.
  void begin(const hal::Frame& frame, const Request&, hal::Scanner* unpacks = nullptr) MOLDLOFT_NONBLOCKING;
  bool step() MOLDLOFT_NONBLOCKING;
  bool waits() const MOLDLOFT_NONBLOCKING;  // step() can do nothing before more of the frame has arrived
  // Pieces of one kind cost alike (BackgroundTask::next_kind()); of the others only the quantum is certain.
  enum class PieceKind : std::uint8_t {
    other,
    unpack,
    walk_stripes,
    cut_stripes,
    find_plate,
    describe_plate
  };
  PieceKind next_kind() const MOLDLOFT_NONBLOCKING;
  bool found() const { return !runs_.empty(); }
  const hal::Frame& frame() const { return *frame_; }  // that was begun last

  const geometry::BoundaryViewer::View& boundary() const { return boundary_; }
  std::span<const geometry::PlateRun> runs() const { return runs_; }
  // Where a run begins and ends: at the plate's edge, or at its last good point.
  Eigen::Vector3d first_of(const geometry::PlateRun&) const MOLDLOFT_NONBLOCKING;
  Eigen::Vector3d last_of(const geometry::PlateRun&) const MOLDLOFT_NONBLOCKING;

  // Walks through the good points on the plate, away from its edges. next() fills `out` with as many as fit and returns
  // how many; 0 when all have been given.
  struct Lattice {
    std::uint32_t stripe_stride = 1, point_stride = 1;
    std::uint32_t first_stripe = 0;  // the strides are counted from here
  };
  void rewind(const Lattice&) MOLDLOFT_NONBLOCKING;
  std::size_t next(std::span<Eigen::Vector3d> out) MOLDLOFT_NONBLOCKING;

  std::size_t bytes() const;

 private:
  enum class Stage : std::uint8_t { cut, find, boundary, done };
  static constexpr std::size_t points_a_step = 2048, stripes_a_step = 8, runs_a_step = 16;
  // Counts of the frame's points, from the first: those unpacked so far, and those that the next cut needs.
  std::size_t points_here() const MOLDLOFT_NONBLOCKING;
  std::size_t points_wanted() const MOLDLOFT_NONBLOCKING;
  bool end() MOLDLOFT_NONBLOCKING;
  bool within_margins(const geometry::PlateRun&, std::uint32_t point) const;
  bool is_outlier(const geometry::PlateRun&, std::uint32_t point) const;
  Eigen::Vector3d point_of(const geometry::PlateRun&, std::uint32_t point) const MOLDLOFT_NONBLOCKING;

  ShotViewSettings settings_;
  geometry::PlateRunFinder finder_;
  geometry::BoundaryViewer viewer_;
  std::vector<geometry::StripeView> stripes_;
  std::span<const geometry::PlateRun> runs_;
  geometry::BoundaryViewer::View boundary_;
  Request request_;
  const hal::Frame* frame_ = nullptr;
  hal::Scanner* unpacks_ = nullptr;
  Stage stage_ = Stage::done;
  std::size_t run_ = 0;  // where the walk stands
  std::uint32_t point_ = 0;
  Lattice lattice_;
};

}  // namespace moldloft::tasks
