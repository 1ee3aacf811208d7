// Which parts of a plate were seen: the outline filled with small cells, and the runs of all shots drawn into them.
//
// Frame        world, mm, plan view
// Cost         a few milliseconds
#pragma once

#include "firmware_like/results/outline_trace.hpp"
#include "tasks/cell/shot_evidence.hpp"

#include <Eigen/Core>

#include <cstdint>
#include <vector>

namespace moldloft::firmware_like {

struct UnseenPart {
  Eigen::Vector2d centre{0, 0}, low{0, 0}, high{0, 0};  // of its cells
  double area_mm2 = 0;
};

class SightMap {
 public:
  // Draws the runs of the shots that found the plate.
  SightMap(const OutlineTrace&, const tasks::RunEvidence&);

  // What lies inside the outline and was not seen, cells that touch counted as one part, the largest first. Cells that
  // the outline itself crosses are left out: where the plate ends is told by its edge points.
  std::vector<UnseenPart> unseen() const;
  double cell_mm() const { return cell_mm_; }

 private:
  enum class Cell : std::uint8_t { outside, unseen, seen };
  Cell& at(int column, int row) { return cells_[static_cast<std::size_t>(row) * columns_ + column]; }
  Cell at(int column, int row) const { return cells_[static_cast<std::size_t>(row) * columns_ + column]; }
  void fill_inside(const OutlineTrace&);
  void draw(const tasks::SeenRun&, const Eigen::Vector2d& across, double half_width_mm);

  Eigen::Vector2d low_{0, 0};
  double cell_mm_ = 0;
  int columns_ = 0, rows_ = 0;
  std::vector<Cell> cells_;
};

}  // namespace moldloft::firmware_like
