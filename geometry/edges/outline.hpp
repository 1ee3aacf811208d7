// The plate's outline in plan view from all edge points that were seen: four corners, counter-clockwise,
// joined by four smooth sides.
//
// Each edge point is given to the side whose chord it lies along, the sides are fitted as cubic B-spline
// curves by least squares with Tukey's biweight (few control points: an edge is smooth, its noise is not),
// neighbouring sides are extended to meet, and the meeting point is the corner.
//
// Frame        world, plan view (x, y), mm
// Work         step() does one bounded piece (128 points, or six trial solutions of one side); the caller decides
//              how many a tick
// Allocation   in the constructor only
// Failure      Error::not_four_sided (hints), too_few_points (in all, or a side without points), not_finite,
//              collinear (hints that span no area or go clockwise, sides that do not meet), capacity
#pragma once

#include "geometry/error.hpp"
#include "geometry/nonblocking.hpp"
#include "geometry/splines/bspline.hpp"

#include <Eigen/Core>

#include <array>
#include <cstdint>
#include <expected>
#include <memory>
#include <span>
#include <vector>

namespace moldloft::geometry {

struct Outline {
  std::array<Eigen::Vector2d, 4> corners;  // counter-clockwise
  // sides[i] runs from corners[i] to corners[(i + 1) % 4]; all four share one clamped uniform knot vector.
  std::array<PlanCurve, 4> sides;
  double rms_mm = 0;  // edge points about their sides, weighted
  double max_mm = 0;  // the largest residual among points that kept weight
};

struct OutlineSettings {
  int spans = 4;                 // of each side: 7 control points
  double noise_mm = 0.1;         // of one edge point across the side: sampling, robot, noise
  double corner_guard_mm = 1.0;  // points nearer than this to a corner belong to no side
};

class OutlineBuilder {
 public:
  OutlineBuilder(std::size_t max_points, const OutlineSettings&);
  ~OutlineBuilder();
  OutlineBuilder(OutlineBuilder&&) noexcept;

  // `corner_hints`: the tracker's corners, counter-clockwise, good to a few millimetres. `left_out`: a point
  // whose entry is not 0 belongs to no side; empty where all may. All are the caller's and must stay until
  // the work is done.
  std::expected<void, Error> begin(std::span<const Eigen::Vector2d> points,
                                   std::span<const Eigen::Vector2d> corner_hints,
                                   std::span<const std::uint8_t> left_out = {}) MOLDLOFT_GEOMETRY_NONBLOCKING;
  std::expected<bool, Error> step() MOLDLOFT_GEOMETRY_NONBLOCKING;  // true when the outline is ready
  const Outline& outline() const { return outline_; }
  std::size_t bytes() const;

 private:
  struct Side;
  struct SidePass;
  enum class Stage : std::uint8_t { idle, assign, sort, fit, corners, finish, done };

  void assign_chunk();
  std::expected<void, Error> sort_by_side();
  std::expected<bool, Error> fit_pass();  // true when the side at hand is done
  void begin_pass();
  bool add_points(std::span<const std::uint32_t> members);
  bool try_stiffnesses();
  bool look_at_residuals(std::span<const std::uint32_t> members);
  bool end_pass(std::span<const std::uint32_t> members);
  std::expected<void, Error> meet_corners();
  void finish();

  OutlineSettings settings_;
  Outline outline_;
  std::span<const Eigen::Vector2d> points_;
  std::span<const std::uint8_t> left_out_;
  std::vector<std::uint8_t> side_of_;  // of every point, 4 for none
  std::vector<std::uint32_t> order_;   // points side by side
  std::vector<double> residual_, scratch_;
  std::vector<Side> sides_;  // four
  std::unique_ptr<SidePass> side_pass_;
  Stage stage_ = Stage::idle;
  std::size_t next_point_ = 0;
  int round_ = 0, side_ = 0, pass_ = 0;
};

}  // namespace moldloft::geometry
