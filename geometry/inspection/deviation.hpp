// Signed deviations of points from a surface: where a plate differs from what it must become.
//
// Sign         positive on the side to which r_u x r_v points (foot_point.hpp): for a plate with u along x
//              and v along y, points above the design are positive: material stands too high there
// Border       a point whose foot is on the border and which stands farther beyond it than the tolerance has
//              no counterpart on the surface: it is classed beyond_border, keeps its foot and its signed
//              distance to the tangent plane there, and takes no part in statistics and maps
// Feet         started from the plan view where the surface is explicit, else from the foot of the point
//              before while the points come close together, else from a global search: right in any order,
//              fast in the order of the scan
// Frame        points are carried by `design_from_plate` to the surface's frame; mm
// Accuracy     deviations within 1e-11 mm, feet within 1e-6 mm along the surface, for plates within 1e4 mm
//              of the origin
// Cost         0.1..0.25 us a point within 20 mm of an explicit surface; a summary 20 ns a point
// Allocation   none
// Failure      Error::not_finite or too_large with the point's index: nothing after it has been written.
//              sizes_differ: fewer places than points, and nothing has been written
#pragma once

#include "geometry/error.hpp"
#include "geometry/inspection/foot_point.hpp"
#include "geometry/rigid_motion.hpp"

#include <array>
#include <cstdint>
#include <expected>
#include <span>

namespace moldloft::geometry {

struct Deviation {
  double mm = 0;  // signed
  double u = 0, v = 0;
  double overhang_mm = 0;  // how far beyond the border the point stands, 0 in the interior
  FootPlace place = FootPlace::interior;
  bool beyond_border = false;
};

struct DeviationSettings {
  RigidMotion design_from_plate = RigidMotion::Identity();
  // Points that stand no farther beyond the border still count: noise puts half of those on the edge there.
  double border_tolerance_mm = 0.5;
};

std::expected<void, Flaw> measure_deviations(const PreparedSurface&, std::span<const Eigen::Vector3d> points,
                                             const DeviationSettings&, std::span<Deviation> out);

struct DeviationSummary {
  std::size_t count = 0, beyond_border = 0;
  double mean_mm = 0, rms_mm = 0;
  double least_mm = 0, most_mm = 0;  // signed extremes, and which points they are
  std::size_t least_point = 0, most_point = 0;
  // Signed, by nearest rank: the share of points at or below.
  static constexpr std::array<double, 7> levels{0.01, 0.05, 0.25, 0.5, 0.75, 0.95, 0.99};
  std::array<double, 7> percentiles_mm{};
};

// `scratch` holds at least as many numbers as there are deviations. All zero without a single counting point.
DeviationSummary summarize(std::span<const Deviation>, std::span<double> scratch);

// Deviations gathered on a grid of (u, v): what a picture or a report shows. The caller's cells,
// rows along u.
struct DeviationCell {
  std::uint32_t count = 0;
  double sum_mm = 0, least_mm = 0, most_mm = 0;
  double mean_mm() const { return count > 0 ? sum_mm / count : 0; }
};

class DeviationMap {
 public:
  // cells.size() = rows * columns; cleared here.
  DeviationMap(const PreparedSurface&, std::span<DeviationCell> cells, int rows, int columns);

  void add(std::span<const Deviation>);
  const DeviationCell& cell(int row, int column) const { return cells_[index(row, column)]; }
  int rows() const { return rows_; }
  int columns() const { return columns_; }

 private:
  std::size_t index(int row, int column) const {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(columns_) +
           static_cast<std::size_t>(column);
  }
  std::span<DeviationCell> cells_;
  int rows_, columns_;
  double first_u_, first_v_, per_u_, per_v_;
};

}  // namespace moldloft::geometry
