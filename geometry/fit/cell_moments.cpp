#include "geometry/fit/cell_moments.hpp"

#include <algorithm>

namespace moldloft::geometry {

void MomentGrid::clear() { std::fill(cells_.begin(), cells_.end(), CellMoments{}); }

void MomentGrid::merge_row(int i, const MomentGrid& fine) {
  const int halves_u = fine.cells_u_ / cells_u_, halves_v = fine.cells_v_ / cells_v_;
  for (int j = 0; j < cells_v_; ++j) {
    CellMoments& out = cell(i, j);
    out = CellMoments{};
    for (int a = 0; a < halves_u; ++a) {
      for (int b = 0; b < halves_v; ++b) {
        const double u0 = double(a) / halves_u, u1 = double(a + 1) / halves_u;
        const double v0 = double(b) / halves_v, v1 = double(b + 1) / halves_v;
        const CellMoments& in = fine.cell(i * halves_u + a, j * halves_v + b);
        add_restricted<6>(restriction<6>(u0, u1), restriction<6>(v0, v1), in.gram, out.gram);
        add_restricted<3>(restriction<3>(u0, u1), restriction<3>(v0, v1), in.load, out.load);
      }
    }
  }
}

}  // namespace moldloft::geometry
