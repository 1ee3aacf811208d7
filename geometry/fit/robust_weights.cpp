#include "geometry/fit/robust_weights.hpp"

#include "geometry/tukey.hpp"

#include <algorithm>
#include <vector>

namespace moldloft::geometry {

namespace {

// The surface of each cell in Bezier form. The knots of the grid's cells hold the net's.
std::vector<std::array<double, 16>> bezier_cells(const NetCandidate& c, const MomentGrid& grid) {
  struct Part {
    int cell;
    std::array<std::array<double, 4>, 4> turned;  // coefficients go the other way than moments
  };
  const auto parts = [](const SpanTable& table, int fine) {
    const double begin = table[0].begin, step = (table[table.spans() - 1].end - begin) / fine;
    std::vector<Part> all(static_cast<std::size_t>(fine));
    for (int k = 0, cell = 0; k < fine; ++k) {
      while (cell + 1 < table.spans() && begin + (k + 0.5) * step > table[cell].end) ++cell;
      const double length = table[cell].end - table[cell].begin;
      const auto r = fine == table.spans()
                         ? restriction<3>(0, 1)
                         : restriction<3>((begin + k * step - table[cell].begin) / length,
                                          (begin + (k + 1) * step - table[cell].begin) / length);
      Part& part = all[static_cast<std::size_t>(k)];
      part.cell = fine == table.spans() ? k : cell;
      for (int p = 0; p < 4; ++p) {
        for (int l = 0; l < 4; ++l) part.turned[l][p] = r[p][l];
      }
    }
    return all;
  };
  const std::vector<Part> u = parts(c.net.spans_u(), grid.cells_u()),
                          v = parts(c.net.spans_v(), grid.cells_v());
  std::vector<std::array<double, 16>> cells;
  for (const Part& a : u) {
    for (const Part& b : v) {
      add_restricted<3>(a.turned, b.turned, c.net.bezier(c.coefficients, a.cell, b.cell),
                        cells.emplace_back());
    }
  }
  return cells;
}

}  // namespace

ResidualPass residual_pass(const PointColumns& columns, const MomentAccumulator& cells_of,
                           const NetCandidate& fitted, double scale, MomentAccumulator* weights_into) {
  const auto bezier = bezier_cells(fitted, cells_of.grid());
  PointColumns plain = columns;
  plain.weight = {};
  PointBlock block;
  block.shot_rows_wanted = true;
  alignas(64) double height[PointBlock::capacity];
  ResidualPass pass;
  for (std::size_t first = 0; first < columns.size(); first += PointBlock::capacity) {
    (void)cells_of.read(plain, first, block);  // was read without complaint before
    moment_kernel().heights(block, bezier.data(), height);
    for (int k = 0; k < block.count; ++k) {
      const double residual = block.height[k] - height[k];
      pass.largest = std::max(pass.largest, std::abs(residual));
      pass.median.add(residual);
      block.weight[k] = tukey_weight(residual, scale);
      if (!columns.weight.empty()) block.weight[k] *= columns.weight[first + static_cast<std::size_t>(k)];
    }
    if (weights_into != nullptr) weights_into->fold(block);
  }
  return pass;
}

}  // namespace moldloft::geometry
