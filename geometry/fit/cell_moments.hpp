// What the surface fit keeps of its points: per cell of a net 7 x 7 sums of B6 B6 and 4 x 4 sums of z B3
// B3. They are all that least squares with bicubic splines over these cells needs, and the moments of a
// coarser net follow from them exactly. A row of the 7 x 7 carries an
// eighth sum, w z^2 B6_p, so that the squares of the heights are known cell by cell too.
//
// Cost         add: 56 + 16 multiply-adds (the plain form; moment_kernel.hpp has the fast
//              one); merge: moment_kernel.hpp
// Memory       what was not written is not touched
// Allocation   in the constructor only
#pragma once

#include "geometry/splines/bernstein.hpp"
#include "geometry/unwritten.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace moldloft::geometry {

struct alignas(64) CellMoments {
  std::array<double, 56> gram;  // [p * 8 + q]: sum of w B6_p(s) B6_q(t); q = 7: of w B6_p(s) z^2
  std::array<double, 16> load;  // [i * 4 + j]: sum of w z B3_i(s) B3_j(t)

  void add(const BernsteinValues& s, const BernsteinValues& t, double z, double weight) {
    for (int p = 0; p < 7; ++p) {
      const double row = weight * s.sextic[p];
      for (int q = 0; q < 7; ++q) gram[p * 8 + q] += row * t.sextic[q];
      gram[p * 8 + 7] += row * (z * z);
    }
    for (int i = 0; i < 4; ++i) {
      const double row = weight * z * s.cubic[i];
      for (int j = 0; j < 4; ++j) load[i * 4 + j] += row * t.cubic[j];
    }
  }
  // The sextics sum to one.
  double weight() const {
    double sum = 0;
    for (int p = 0; p < 7; ++p) {
      for (int q = 0; q < 7; ++q) sum += gram[p * 8 + q];
    }
    return sum;
  }
  double squares() const {
    double sum = 0;
    for (int p = 0; p < 7; ++p) sum += gram[p * 8 + 7];
    return sum;
  }
};

class MomentGrid {
 public:
  MomentGrid(int cells_u, int cells_v) : MomentGrid(unwritten(cells_u, cells_v)) { clear(); }
  // For a grid that is cleared later, or filled by merging: no cell holds anything yet.
  static MomentGrid unwritten(int cells_u, int cells_v) { return {cells_u, cells_v, Empty{}}; }
  // Other cells, no more than the grid was made with; no cell holds anything then.
  void reshape(int cells_u, int cells_v);

  int cells_u() const { return cells_u_; }
  int cells_v() const { return cells_v_; }
  CellMoments& cell(int i, int j) { return cells_[i * cells_v_ + j]; }
  const CellMoments& cell(int i, int j) const { return cells_[i * cells_v_ + j]; }
  std::uint32_t& points(int i, int j) { return counts_[i * cells_v_ + j]; }
  std::uint32_t points(int i, int j) const { return counts_[i * cells_v_ + j]; }
  CellMoments* cells() { return cells_.data(); }
  const CellMoments* cells() const { return cells_.data(); }
  std::uint32_t* counts() { return counts_.data(); }
  const std::uint32_t* counts() const { return counts_.data(); }
  int cell_count() const { return cells_u_ * cells_v_; }
  void clear(int first, int end);  // of the cells, row after row
  void clear() { clear(0, cell_count()); }

  // Fills the cells [first, end) of this grid, row after row, from `fine`, whose cells are halves of this grid's in
  // u, in v, or in both.
  void merge_cells(int first, int end, const MomentGrid& fine);
  // Fills this grid from `fine`, cell (i, j) from the fine cells [at_u[i], at_u[i + 1]) x [at_v[j], at_v[j
  // + 1]). Allocates for the restriction matrices.
  void merge_blocks(const MomentGrid& fine, std::span<const int> at_u, std::span<const int> at_v);
  // Another grid's sums, same cells. What is taken away must have been added before.
  void add(const MomentGrid& other);
  void subtract(const MomentGrid& other);

  std::size_t bytes() const {
    return cells_.capacity() * sizeof(CellMoments) + counts_.capacity() * sizeof(std::uint32_t);
  }

 private:
  struct Empty {};
  MomentGrid(int cells_u, int cells_v, Empty)
      : cells_u_(cells_u),
        cells_v_(cells_v),
        cells_(static_cast<std::size_t>(cells_u) * cells_v),
        counts_(static_cast<std::size_t>(cells_u) * cells_v) {}

  int cells_u_, cells_v_;
  std::vector<CellMoments, Unwritten<std::allocator<CellMoments>>> cells_;
  std::vector<std::uint32_t, Unwritten<std::allocator<std::uint32_t>>> counts_;
};

// out[p][q] += sum_lm Ru[p][l] in[l][m] Rv[q][m]: a cell's sums, taken over as part of a larger cell.
template <int degree>
void add_restricted(const std::array<std::array<double, degree + 1>, degree + 1>& ru,
                    const std::array<std::array<double, degree + 1>, degree + 1>& rv,
                    const std::array<double, (degree + 1) * (degree + 1)>& in,
                    std::array<double, (degree + 1) * (degree + 1)>& out) {
  constexpr int n = degree + 1;
  std::array<double, n * n> half{};
  for (int p = 0; p < n; ++p) {
    for (int l = 0; l < n; ++l) {
      for (int m = 0; m < n; ++m) half[p * n + m] += ru[p][l] * in[l * n + m];
    }
  }
  for (int p = 0; p < n; ++p) {
    for (int q = 0; q < n; ++q) {
      double sum = 0;
      for (int m = 0; m < n; ++m) sum += half[p * n + m] * rv[q][m];
      out[p * n + q] += sum;
    }
  }
}

}  // namespace moldloft::geometry
