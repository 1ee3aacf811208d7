// Solves one net: moments to normal equations, fairing, boundary, factor, shot offsets, coefficients,
// residual. In bounded pieces.
//
// Objective    sum w (z - f)^2 + fairing, the thin-plate energy with a weight relative to the data
//              (ratio of traces)
// Boundary     the outer ring of coefficients, if given: moved to the right side (thesis eq. 3.40, 3.41),
//              or pulled at with a weight
// Cost         unknowns * half_band^2 / 2 in all. A step takes at most `work_a_step` multiply-adds, or, if that is
//              more, one panel of eight columns or one column of at most 52,000; work() counts them
// Allocation   in the constructor only
// Failure      Error::singular where a pivot is not positive; singular_unknown() says which. capacity where the net
//              is larger than the constructor was told; too_large where a sum overflows
#pragma once

#include "geometry/error.hpp"
#include "geometry/fit/shot_offsets.hpp"
#include "geometry/fit/spline_net.hpp"
#include "geometry/splines/band_cholesky.hpp"

#include <array>
#include <cstdint>
#include <expected>
#include <limits>
#include <span>
#include <vector>

namespace moldloft::geometry {

// What the points add up to, whatever the net.
struct PointTotals {
  std::uint64_t points = 0;
  double weight = 0, squares = 0;  // sum of w and of w z^2
};

struct NetTask {
  const SplineNet* net = nullptr;
  const MomentGrid* moments = nullptr;
  PointTotals totals;
  double length_u_mm = 1, length_v_mm = 1;
  double fairing = 0;         // everywhere
  double sparse_fairing = 0;  // on top, in cells with fewer points than sparse_points
  std::uint32_t sparse_points = 1;
  double shot_sigma_mm = 0;   // 0: no offsets
  double point_sigma_mm = 0;  // of one point of weight 1; 0: estimated from this net without offsets
  // Coefficients whose outer ring is given, by net->index(); empty: free. Not together with shot offsets.
  std::span<const double> boundary;
  double boundary_weight = std::numeric_limits<double>::infinity();  // in points; infinite: interpolated
};

struct NetResult {
  double squares = 0;  // weighted sum of squared residuals
  double freedom = 0;  // degrees of freedom that the model takes: coefficients with data, and offsets
  double point_sigma_mm = 0;
  double smallest_pivot = 0;  // relative to the largest
  int smallest_pivot_unknown = 0;
  // Standard deviation of the height at (0, 0), (1, 0), (1, 1), (0, 1) from the points' noise: a corner of the surface
  // is one coefficient, and no point lies beyond it. 0 where the ring is given. Offsets are taken as known.
  std::array<double, 4> corner_sigma_mm{};
  int empty_cells = 0, sparse_cells = 0;  // without points; with some, but fewer than sparse_points
  double offset_rms_mm = 0, offset_max_mm = 0;
};

class NetSolver {
 public:
  // Small steps cost little more in all, and they are what a tick must leave room for: 2 us with AVX-512, 100 us on
  // a processor of 500 million instructions a second.
  static constexpr double work_a_step = 20'000;

  NetSolver(std::size_t max_unknowns, std::size_t max_half_band);

  bool holds(const SplineNet&) const;
  void start(const NetTask&, ShotOffsets*);
  std::expected<bool, Error> step(double budget = work_a_step);  // of multiply-adds
  std::expected<void, Error> solve();                            // all steps
  double progress() const;
  const NetResult& result() const { return result_; }
  std::span<const double> coefficients() const { return {right_.data(), static_cast<std::size_t>(size())}; }
  int singular_unknown() const { return matrix_.failed_column(); }
  double work() const { return work_; }  // multiply-adds of the last step
  bool full() const { return full_; }    // it ended because its next piece had no room
  const BandCholesky& factor() const { return matrix_; }
  double norm_one() const { return norm_one_; }  // of the matrix that was factored, if asked for before
  void want_norm(bool wanted) { norm_wanted_ = wanted; }
  std::size_t bytes() const;

 private:
  enum class Stage {
    clear,
    data,
    fair,
    border,
    norm,
    factor,
    forward,
    touch,
    columns,
    scatter,
    lower,
    form,
    schur,
    offsets,
    backward,
    corners,
    energy,
    sparse_energy,
    done,
    net_too_large
  };

  int size() const { return task_.net->unknowns(); }
  std::expected<bool, Error> piece();  // as much of one stage as the step has room for
  // Advances the cursor by one slice; true when it has reached `end`, and then it starts again from 0.
  template <typename Piece>
  bool advance(int end, double cost_of_one, Piece&& piece, int grain = 1);
  void add_data(int first_cell, int end_cell);
  void add_sparse_fairing_row(int row);
  void add_border();
  void take_norm(int first, int end);
  bool on_border(int unknown) const;
  void subtract_sparse_energy(int row);
  void estimate_noise(double y_squared);
  void take_offsets();
  bool step_corners();
  int corner_unknown(int corner) const;
  bool step_shots();
  // The cells of one shot after the other, until the step is full; true when all are done.
  template <typename Piece>
  bool each_shot(double cost_of_cell, Piece&& piece);
  void finish();

  NetTask task_;
  ShotOffsets* shots_ = nullptr;
  NetResult result_;
  BandCholesky matrix_;
  std::vector<double> right_, data_diagonal_, column_sums_, corner_;
  Stage stage_ = Stage::done;
  int cursor_ = 0, column_ = 0, row_ = 0;
  std::size_t shot_cell_ = 0;
  bool norm_wanted_ = false;
  double trace_data_ = 0, fairing_ = 0, sparse_fairing_ = 0, rho_ = 0, objective_ = 0, border_squares_ = 0;
  double work_ = 0, budget_ = work_a_step, norm_one_ = 0;
  bool full_ = false;  // the next piece does not fit into the step any more
};

}  // namespace moldloft::geometry
