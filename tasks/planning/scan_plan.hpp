// The zig-zag: which shots cover the plate. The outline's bounding box, turned to the plate so that its
// area is least, is cut into rows. Each row has as many shots as the outline is long there, and every
// other row runs backwards. (This is the thesis's section 5.3.3, without its assumption that the plate
// lies along the axes.)
//
// Frame        world, plan view, mm; the centre's height comes from the height model
// Work         step() does one bounded piece: one side's samples, the box, one row; 25,000 instructions at most
// Allocation   none: shots go into the caller's array, from the corner of the box that is nearest to the arm on
// Failure      geometry::Error::capacity when the plate needs more shots than the array holds
#pragma once

#include "geometry/edges/outline.hpp"
#include "geometry/error.hpp"
#include "hal/base/realtime.hpp"
#include "tasks/machines/boundary_tracker.hpp"
#include "tasks/planning/height_model.hpp"

#include <array>
#include <cstdint>
#include <expected>
#include <span>
#include <utility>

namespace moldloft::tasks {

struct ScanPlanSettings {
  double field_x_mm = 102, field_y_mm = 102;
  double overlap_mm = 10;  // of neighbouring fields; also what perspective and robot errors may eat
  double margin_mm = 2;    // of the field beyond the outline
};

class ZigzagPlan {
 public:
  // Of the two yaws that look the same the one nearer to `head_yaw_now` is taken. Outline, heights and `places` stay as
  // they are until the plan is done.
  void begin(const geometry::Outline&, const HeightModel& heights, const ScanPlanSettings&,
             const Eigen::Vector2d& from, double head_yaw_now,
             std::span<ShotPlace> places) MOLDLOFT_NONBLOCKING;
  bool step() MOLDLOFT_NONBLOCKING;  // true when the plan is done
  // How many of `places` are filled, in the order of travel.
  std::expected<std::size_t, geometry::Error> result() const MOLDLOFT_NONBLOCKING;

 private:
  enum class Stage : std::uint8_t { sample, turn, rows, too_many, done };
  static constexpr std::size_t samples_per_side = 64;
  struct Spread {  // of fields over a length: the first one's middle, and evenly on from there
    int count = 1;
    double first = 0, step = 0;
  };

  void sample_side(std::size_t side) MOLDLOFT_NONBLOCKING;
  void turn_to_plate() MOLDLOFT_NONBLOCKING;
  bool add_row() MOLDLOFT_NONBLOCKING;
  Spread spread(double from, double to, double field) const MOLDLOFT_NONBLOCKING;
  std::pair<double, double> extent_between(double low, double high) const MOLDLOFT_NONBLOCKING;

  const geometry::Outline* outline_ = nullptr;
  const HeightModel* heights_ = nullptr;
  ScanPlanSettings settings_;
  Eigen::Vector2d from_{0, 0};
  std::span<ShotPlace> places_;
  // Of the outline; in the box's axes once it is known.
  std::array<Eigen::Vector2d, 4 * samples_per_side> points_;
  Eigen::Matrix2d box_from_world_;
  Spread rows_;
  double yaw_ = 0;
  std::size_t side_ = 0, count_ = 0;
  int row_ = 0;
  bool from_top_ = false, forwards_ = false;
  Stage stage_ = Stage::done;
};

}  // namespace moldloft::tasks
