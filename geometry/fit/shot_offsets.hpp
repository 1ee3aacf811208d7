// The unknown height errors of the shots, fitted together with the surface.
//
// With d_s the offset of shot s, prior weight rho = (sigma / sigma_shot)^2, and L the band factor of the
// surface's normal equations, the bordered system is eliminated on the shots:
//     S d = h - W' y,   S = D + rho I - W' W,   W = L^-1 B,   y = L^-1 r
// where column s of B holds the sums of the basis functions over the points of shot s (the right-hand side for z = 1),
// D the number of points and h the sum of heights of every shot. The surface follows from L' c = y - W d.
//
// Memory       a shot's moments are kept only for the cells that it touches; when the plan is full, the shot at
//              hand and those after it are taken as exact and counted
// Allocation   in the constructor only
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "geometry/fit/spline_net.hpp"

namespace moldloft::geometry {

class ShotOffsets {
 public:
  ShotOffsets(int max_shots, int cells_u, int cells_v, std::size_t max_shot_cells, std::size_t max_unknowns);

  void clear();
  void add(int shot, int cell_u, int cell_v, const BernsteinValues& s, const BernsteinValues& t, double z,
           double weight);
  void finish_adding();  // before the columns are built
  int count() const {
    return static_cast<int>(slots_.size());
  }  // shots with points, in order of their numbers
  int exact() const { return exact_; }

  // For one net: clear, scatter all shot cells in chunks, bring every column to W by the caller's band solve,
  // then form the rows of S one by one, and factor and solve it.
  void start(int unknowns);
  std::span<double> column(int slot) {
    return {&columns_[static_cast<std::size_t>(slot) * unknowns_], unknowns_};
  }
  std::size_t shot_cells() const { return cells_.size(); }
  void scatter(const SplineNet&, int cells_u, int cells_v, std::size_t first, std::size_t end);
  void form(int row, int first, int end,
            std::span<const double> y);  // columns [first, end) of a row, end <= row + 1
  bool factor_row(int row, double rho);  // rows in order
  void solve();
  double offset(int slot) const { return offsets_[slot]; }
  // sum of h_s d_s: what the offsets take from the sum of squares
  double explained() const;

  std::size_t bytes() const;

 private:
  struct Slot {
    int shot;
    double weight, height;
  };
  struct ShotCell {
    std::uint32_t cell;
    std::uint32_t slot;
    std::array<double, 16> moments;
  };
  int cells_u_, cells_v_;
  std::size_t unknowns_ = 0;
  int exact_ = 0, current_shot_ = -1;
  bool current_is_exact_ = false;
  std::vector<std::int32_t> slot_of_shot_;
  std::vector<std::int32_t> place_of_cell_;  // of the shot at hand
  std::vector<Slot> slots_;
  std::vector<ShotCell> cells_;
  std::vector<double> columns_, offsets_, right_;
  Eigen::MatrixXd schur_;

  void leave_shot();
};

}  // namespace moldloft::geometry
