#include "geometry/fit/cell_moments.hpp"

#include "geometry/fit/moment_kernel.hpp"

#include <algorithm>
#include <cassert>

namespace moldloft::geometry {

void MomentGrid::clear(int first, int end) {
  std::fill(cells_.begin() + first, cells_.begin() + end, CellMoments{});
  std::fill(counts_.begin() + first, counts_.begin() + end, 0u);
}

void MomentGrid::reshape(int cells_u, int cells_v) {
  assert(static_cast<std::size_t>(cells_u) * cells_v <= cells_.size());
  cells_u_ = cells_u, cells_v_ = cells_v;
}

void MomentGrid::merge_cells(int first, int end, const MomentGrid& fine) {
  const int halves_u = fine.cells_u_ / cells_u_, halves_v = fine.cells_v_ / cells_v_;
  assert(halves_u * cells_u_ == fine.cells_u_ && halves_u <= 2);
  assert(halves_v * cells_v_ == fine.cells_v_ && halves_v <= 2);
  const MomentKernel& kernel = moment_kernel();
  for (int k = first; k < end; ++k) {
    const int i = k / cells_v_, j = k % cells_v_;
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

namespace {

// A fine cell's share of its coarse cell, for gram and for load, with the eighth sum of a row left as it is.
struct Share {
  double six[7][7], three[4][4];
};

std::vector<Share> shares(std::span<const int> at) {
  std::vector<Share> all;
  for (std::size_t i = 0; i + 1 < at.size(); ++i) {
    const double length = at[i + 1] - at[i];
    for (int k = 0; k < at[i + 1] - at[i]; ++k) {
      const auto six = restriction<6>(k / length, (k + 1) / length);
      const auto three = restriction<3>(k / length, (k + 1) / length);
      Share& share = all.emplace_back();
      for (int p = 0; p < 7; ++p) std::copy(six[p].begin(), six[p].end(), share.six[p]);
      for (int p = 0; p < 4; ++p) std::copy(three[p].begin(), three[p].end(), share.three[p]);
    }
  }
  return all;
}

void add_rows(const Share& u, const CellMoments& in, CellMoments& out) {
  for (int p = 0; p < 7; ++p) {
    for (int l = 0; l < 7; ++l) {
      for (int q = 0; q < 8; ++q) out.gram[8 * p + q] += u.six[p][l] * in.gram[8 * l + q];
    }
  }
  for (int p = 0; p < 4; ++p) {
    for (int l = 0; l < 4; ++l) {
      for (int q = 0; q < 4; ++q) out.load[4 * p + q] += u.three[p][l] * in.load[4 * l + q];
    }
  }
}

void add_columns(const Share& v, const CellMoments& in, CellMoments& out) {
  for (int p = 0; p < 7; ++p) {
    for (int q = 0; q < 7; ++q) {
      for (int m = 0; m < 7; ++m) out.gram[8 * p + q] += in.gram[8 * p + m] * v.six[q][m];
    }
    out.gram[8 * p + 7] += in.gram[8 * p + 7];
  }
  for (int p = 0; p < 4; ++p) {
    for (int q = 0; q < 4; ++q) {
      for (int m = 0; m < 4; ++m) out.load[4 * p + q] += in.load[4 * p + m] * v.three[q][m];
    }
  }
}

}  // namespace

void MomentGrid::merge_blocks(const MomentGrid& fine, std::span<const int> at_u, std::span<const int> at_v) {
  assert(static_cast<int>(at_u.size()) == cells_u_ + 1 && at_u.back() == fine.cells_u_);
  assert(static_cast<int>(at_v.size()) == cells_v_ + 1 && at_v.back() == fine.cells_v_);
  const std::vector<Share> u = shares(at_u), v = shares(at_v);
  clear();
  for (int i = 0; i < cells_u_; ++i) {
    for (int j = 0; j < cells_v_; ++j) {
      for (int b = at_v[j]; b < at_v[j + 1]; ++b) {
        CellMoments column{};
        for (int a = at_u[i]; a < at_u[i + 1]; ++a) {
          add_rows(u[a], fine.cell(a, b), column);
          points(i, j) += fine.points(a, b);
        }
        add_columns(v[b], column, cell(i, j));
      }
    }
  }
}

void MomentGrid::add(const MomentGrid& other) {
  assert(other.cells_u_ == cells_u_ && other.cells_v_ == cells_v_);
  for (int k = 0; k < cell_count(); ++k) {
    for (std::size_t m = 0; m < 56; ++m) cells_[k].gram[m] += other.cells_[k].gram[m];
    for (std::size_t m = 0; m < 16; ++m) cells_[k].load[m] += other.cells_[k].load[m];
    counts_[k] += other.counts_[k];
  }
}

// A cell that has lost all its points is exactly empty again; what rounding left is not taken for data.
void MomentGrid::subtract(const MomentGrid& other) {
  assert(other.cells_u_ == cells_u_ && other.cells_v_ == cells_v_);
  for (int k = 0; k < cell_count(); ++k) {
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
