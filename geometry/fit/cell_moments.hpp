// What the surface fit keeps of its points: per cell of a net 7 x 7 sums of B6 B6 and 4 x 4 sums of z B3 B3.
// They are all that least squares with bicubic splines over these cells needs (field notes, "Bernstein
// moments"), and the moments of a coarser net follow from them exactly.
//
// Cost         add: 49 + 16 multiply-adds; merge of 2 x 2 cells: 3,000
// Allocation   in the constructor only
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "geometry/splines/bernstein.hpp"

namespace moldloft::geometry {

struct CellMoments {
  std::array<double, 49> gram;  // [p * 7 + q]: sum of w B6_p(s) B6_q(t)
  std::array<double, 16> load;  // [i * 4 + j]: sum of w z B3_i(s) B3_j(t)

  void add(const BernsteinValues& s, const BernsteinValues& t, double z, double weight) {
    for (int p = 0; p < 7; ++p) {
      const double row = weight * s.sextic[p];
      for (int q = 0; q < 7; ++q) gram[p * 7 + q] += row * t.sextic[q];
    }
    for (int i = 0; i < 4; ++i) {
      const double row = weight * z * s.cubic[i];
      for (int j = 0; j < 4; ++j) load[i * 4 + j] += row * t.cubic[j];
    }
  }
  double weight() const {  // the sextics sum to one
    double sum = 0;
    for (const double m : gram) sum += m;
    return sum;
  }
};

class MomentGrid {
 public:
  MomentGrid(int cells_u, int cells_v) : cells_u_(cells_u), cells_v_(cells_v), cells_(cells_u * cells_v) {}

  int cells_u() const { return cells_u_; }
  int cells_v() const { return cells_v_; }
  CellMoments& cell(int i, int j) { return cells_[i * cells_v_ + j]; }
  const CellMoments& cell(int i, int j) const { return cells_[i * cells_v_ + j]; }
  void clear();

  // Fills row i of this grid from `fine`, whose cells are halves of this grid's cells in u, in v, or in both.
  void merge_row(int i, const MomentGrid& fine);

  std::size_t bytes() const { return cells_.capacity() * sizeof(CellMoments); }

 private:
  int cells_u_, cells_v_;
  std::vector<CellMoments> cells_;
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
