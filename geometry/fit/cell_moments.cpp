#include "geometry/fit/cell_moments.hpp"

#include <algorithm>
#include <cassert>

#include "geometry/fit/moment_kernel.hpp"

namespace moldloft::geometry {

void MomentGrid::clear() {
  std::fill(cells_.begin(), cells_.end(), CellMoments{});
  std::fill(counts_.begin(), counts_.end(), 0u);
}

void MomentGrid::merge_row(int i, const MomentGrid& fine) {
  const int halves_u = fine.cells_u_ / cells_u_, halves_v = fine.cells_v_ / cells_v_;
  assert(halves_u * cells_u_ == fine.cells_u_ && halves_u <= 2);
  assert(halves_v * cells_v_ == fine.cells_v_ && halves_v <= 2);
  const MomentKernel& kernel = moment_kernel();
  for (int j = 0; j < cells_v_; ++j) {
    const CellMoments* halves[4] = {};
    points(i, j) = 0;
    for (int a = 0; a < halves_u; ++a) {
      for (int b = 0; b < halves_v; ++b) {
        halves[2 * a + b] = &fine.cell(i * halves_u + a, j * halves_v + b);
        points(i, j) += fine.points(i * halves_u + a, j * halves_v + b);
      }
    }
    kernel.merge(halves, cell(i, j));
  }
}

void MomentGrid::add(const MomentGrid& other) {
  assert(other.cells_u_ == cells_u_ && other.cells_v_ == cells_v_);
  for (std::size_t k = 0; k < cells_.size(); ++k) {
    for (std::size_t m = 0; m < 56; ++m) cells_[k].gram[m] += other.cells_[k].gram[m];
    for (std::size_t m = 0; m < 16; ++m) cells_[k].load[m] += other.cells_[k].load[m];
    counts_[k] += other.counts_[k];
  }
}

// A cell that has lost all its points is exactly empty again; what rounding left is not taken for data.
void MomentGrid::subtract(const MomentGrid& other) {
  assert(other.cells_u_ == cells_u_ && other.cells_v_ == cells_v_);
  for (std::size_t k = 0; k < cells_.size(); ++k) {
    assert(counts_[k] >= other.counts_[k]);
    counts_[k] -= other.counts_[k];
    if (counts_[k] == 0) {
      cells_[k] = CellMoments{};
      continue;
    }
    for (std::size_t m = 0; m < 56; ++m) cells_[k].gram[m] -= other.cells_[k].gram[m];
    for (std::size_t m = 0; m < 16; ++m) cells_[k].load[m] -= other.cells_[k].load[m];
  }
}

}  // namespace moldloft::geometry
