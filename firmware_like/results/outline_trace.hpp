// An outline as a closed line of many short pieces: where a point lies against it, and what lies within.
//
// Frame        world, mm, plan view; counter-clockwise
// Accuracy     the pieces miss a side of 500 mm with a sag of 50 mm by 1 micrometre
// Cost         locate() 1 us; the rest as they say
#pragma once

#include "geometry/edges/outline.hpp"

#include <Eigen/Core>

#include <cstddef>
#include <vector>

namespace moldloft::firmware_like {

class OutlineTrace {
 public:
  explicit OutlineTrace(const geometry::Outline&);

  struct Place {
    double distance_mm = 0;  // positive outside
    std::size_t side = 0;
    double from_corner_mm = 0;                           // along the side, to its nearer end
    Eigen::Vector2d outwards = Eigen::Vector2d::Zero();  // of length one
  };
  Place locate(const Eigen::Vector2d&) const;  // the nearest place of the outline

  const std::vector<Eigen::Vector2d>& points() const { return points_; }
  double length_mm() const { return along_.back(); }
  double area_mm2() const;
  // Where a horizontal line crosses the outline: x in order, in pairs between which it runs inside.
  void crossings(double y, std::vector<double>& x) const;

 private:
  static constexpr std::size_t pieces_a_side = 128;
  std::vector<Eigen::Vector2d> points_;  // the first once more at the end
  std::vector<double> along_;            // from the first corner
};

}  // namespace moldloft::firmware_like
