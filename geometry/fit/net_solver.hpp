// Solves one net: moments to normal equations, fairing, factor, shot offsets, coefficients, residual. In
// bounded pieces.
//
// Cost         unknowns * half_band^2 in all; a piece at most about 200,000 multiply-adds
// Allocation   in the constructor only
// Failure      Error::singular where a pivot is not positive
#pragma once

#include <expected>
#include <span>
#include <vector>

#include "geometry/splines/band_cholesky.hpp"
#include "geometry/error.hpp"
#include "geometry/fit/shot_offsets.hpp"
#include "geometry/fit/spline_net.hpp"

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
  double fairing = 0;
  double shot_sigma_mm = 0;   // 0: no offsets
  double point_sigma_mm = 0;  // of one point of weight 1; 0: estimated from this net without offsets
};

struct NetResult {
  double squares = 0;  // weighted sum of squared residuals
  double freedom = 0;  // degrees of freedom that the model takes: coefficients with data, and offsets
  double point_sigma_mm = 0;
  double smallest_pivot = 0;  // relative to the largest
  int empty_cells = 0;
  double offset_rms_mm = 0, offset_max_mm = 0;
};

class NetSolver {
 public:
  NetSolver(std::size_t max_unknowns, std::size_t max_half_band);

  void start(const NetTask&, ShotOffsets*);
  std::expected<bool, Error> step();
  double progress() const;
  const NetResult& result() const { return result_; }
  std::span<const double> coefficients() const { return {right_.data(), static_cast<std::size_t>(size())}; }
  std::size_t bytes() const;

 private:
  enum class Phase {
    clear,
    data,
    fair,
    factor,
    forward,
    columns,
    scatter,
    lower,
    form,
    schur,
    offsets,
    backward,
    energy,
    done
  };

  int size() const { return task_.net->unknowns(); }
  int slice(double cost_of_one) const;
  // Advances the cursor by one slice; true when it has reached `end`, and then it starts again from 0.
  template <typename Piece>
  bool advance(int end, double cost_of_one, Piece&& piece);
  void add_data_row(int row);
  void add_fairing_row(int row);
  void subtract_fairing_energy(int row);
  void estimate_noise();
  void take_offsets();

  NetTask task_;
  ShotOffsets* shots_ = nullptr;
  NetResult result_;
  BandCholesky matrix_;
  std::vector<double> right_, data_diagonal_;
  Phase phase_ = Phase::done;
  int cursor_ = 0, column_ = 0;
  double trace_data_ = 0, trace_fairing_ = 0, fairing_ = 0, rho_ = 0, objective_ = 0;
};

}  // namespace moldloft::geometry
