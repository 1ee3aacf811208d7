// Points added up, as a value: what a least-squares fit over these cells will ever need of them, in memory
// that does not depend on their number.
//
// Additive     points may come in any pieces, from shots, threads or machines: add() appends, merge() adds
//              another's sums. add() gives the same bits however the points are cut into calls; merge() in
//              a fixed order is deterministic
// Removable    subtract() takes another's sums away: what was added with it is forgotten up to rounding,
//              eps times the sums that the cell held with it (a cell that keeps 1 point of n is good to n
//              eps). A cell that has lost all its points is exactly empty
// Weighted     a weight counts as so many points; zero is allowed, negative is an error
// Memory       580 bytes a cell: 0.23 MB for 20 x 20
// Cost         5 ns a point (AVX-512), 8 ns (AVX2), 25 ns (SSE2) on scanner stripes; knots that are not
//              equally spaced 5 ns more
// Failure      not_finite, outside_domain, negative_weight: with the first point that is; the points before
//              it are in
// Threads      one accumulator a thread
#pragma once

#include "geometry/error.hpp"
#include "geometry/fit/cell_moments.hpp"
#include "geometry/fit/net_solver.hpp"
#include "geometry/fit/point_columns.hpp"
#include "geometry/splines/knot_cells.hpp"

#include <cstddef>
#include <expected>
#include <memory>
#include <span>

namespace moldloft::geometry {

struct FitDomain {  // of the columns u and v
  double min_u = 0, max_u = 1, min_v = 0, max_v = 1;
  bool operator==(const FitDomain&) const = default;
};

// What check_cubic_knots() finds, and the first knot that it is about (for a wrong count, how many there are).
std::expected<void, Flaw> check_net_knots(std::span<const double> knots);

class MomentAccumulator {
 public:
  // Equal cells. Heights are summed relative to `datum`: one near the data keeps the digits of their squares.
  MomentAccumulator(int cells_u, int cells_v, const FitDomain& = {}, double datum = 0, Simd = widest_simd());
  // The cells of a net over knots that pass check_net_knots(); the columns are its parameters.
  MomentAccumulator(const SplineNet&, double datum, Simd = widest_simd());

  std::expected<void, Flaw> add(const PointColumns&);
  void merge(const MomentAccumulator&);
  void subtract(const MomentAccumulator&);
  void clear();

  const MomentGrid& grid() const { return grid_; }
  double datum() const { return datum_; }
  const FitDomain& domain() const { return domain_; }
  PointTotals totals() const;  // added up over the cells, in order
  std::size_t bytes() const;

  // add() in two halves, for a pass that looks at residuals and weighs the points in between. A block's
  // cells and Bernstein values, cut short at a point that is refused:
  std::expected<void, Flaw> read(const PointColumns&, std::size_t first, PointBlock&) const;
  // and such a block added with the weights that it has now.
  void fold(PointBlock&);

 private:
  MomentGrid grid_;
  FitDomain domain_;
  double datum_;
  const MomentKernel* kernel_;
  std::shared_ptr<const std::pair<KnotCells, KnotCells>> lookup_;  // null: equal cells
};

}  // namespace moldloft::geometry
