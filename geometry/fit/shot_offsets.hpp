// The unknown height errors of the shots, fitted together with the surface.
//
// With d_s the offset of shot s, prior weight rho = (sigma / sigma_shot)^2, and L the band factor of the
// surface's normal equations, the bordered system is eliminated on the shots:
//     S d = h - W' y,   S = D + rho I - W' W,   W = L^-1 B,   y = L^-1 r
// where column s of B holds the sums of the basis functions over the points of shot s (the right-hand side
// for z = 1), D the number of points and h the sum of heights of every shot. The surface follows from L' c
// = y - W d.
//
// Columns      y and W side by side, row by row, in groups of eight columns; sorted by the first
//              unknown that a shot touches, above which a column is zero, so that a group starts where
//              its first shot does
// Memory       a shot's moments are kept only for the cells that it touches; when the plan is full, the
//              shot at hand and those after it are taken as exact and counted
//              Room that the shots and the net at hand do not need is not touched
// Allocation   in the constructor only
#pragma once

#include "geometry/fit/spline_net.hpp"
#include "geometry/unwritten.hpp"

#include <Eigen/Core>

#include <cstdint>
#include <span>
#include <vector>

namespace moldloft::geometry {

class ShotOffsets {
 public:
  ShotOffsets(int max_shots, int cells_u, int cells_v, std::size_t max_shot_cells, std::size_t max_unknowns);

  // Over these cells, no more than the constructor was told.
  void clear(int cells_u, int cells_v);
  // All points of one shot come before those of the next. The block's shot rows must have been wanted.
  void add(int shot, const PointBlock&);
  void finish_adding();  // before anything below
  // Shots with points, in order of their numbers.
  int count() const { return static_cast<int>(slots_.size()); }
  int exact() const { return exact_; }

  std::size_t cells_of(int slot) const { return slots_[slot].end - slots_[slot].begin; }

  // From one net to the next coarser one: the cells of every slot merge, piece by piece in order
  // (`first` and `end` count the slot's cells, cells_of() before the first piece), then coarsened() says
  // to which net's.
  void coarsen(int slot, const MomentGrid& to, std::size_t first, std::size_t end);
  void coarsened(const MomentGrid& to) { level_u_ = to.cells_u(), level_v_ = to.cells_v(); }

  // For one net: touch() every slot, start(), clear_rows(), scatter() every slot and the right-hand side of
  // y, solve all groups by the caller's band solve, form() all blocks, then factor and solve.
  void touch(int slot, const SplineNet&, std::size_t first, std::size_t end);
  void start(const SplineNet&);
  int row_length() const { return row_length_; }
  int groups() const { return row_length_ / 8; }
  int first_row(int group) const { return first_row_[group]; }
  std::span<double> columns() { return {columns_.data(), unknowns_ * row_length_}; }
  void clear_rows(int first, int end);
  void scatter(int slot, const SplineNet&, std::size_t first, std::size_t end);
  void set_y(int row, double right) { columns_[static_cast<std::size_t>(row) * row_length_] = right; }
  // Adds the rows [first, end) to the block (a, b) of [y W]'[y W], b <= a, both groups.
  void form(const BandKernel&, int group_a, int group_b, int first, int end);
  double y_squared() const { return blocks_.empty() ? 0 : blocks_[0]; }
  bool factor_row(int row, double rho);  // rows in order
  void solve();
  double offset(int slot) const { return offsets_[slot]; }
  // Row i of y - W d.
  double moved(int row) const;
  double y(int row) const { return columns_[static_cast<std::size_t>(row) * row_length_]; }
  // sum of h_s d_s: what the offsets take from the sum of squares
  double explained() const;

  std::size_t bytes() const;

 private:
  struct Slot {
    int shot;
    std::size_t begin, end;  // of its cells
    double height;           // sum of w z
    double weight = 0;
    int column = 0, first_row = 0;
  };
  struct ShotCell {
    std::int32_t cell;
    std::array<double, 16> moments;
  };
  void leave_shot();
  std::int32_t place_of(std::int32_t cell);
  void give_up(Slot&);
  double gram(int column_a, int column_b) const;

  int level_u_ = 0, level_v_ = 0;  // of the net that the cells have been merged for
  std::size_t unknowns_ = 0;
  int row_length_ = 8;
  int exact_ = 0, current_slot_ = -1;
  bool current_is_exact_ = false;
  std::size_t kept_ = 0;  // of the slot that coarsen() is at
  std::vector<std::int32_t> slot_of_shot_;
  std::vector<std::int32_t> place_of_cell_;  // of the shot at hand
  std::vector<Slot> slots_;
  std::vector<ShotCell> cells_;
  std::vector<int> order_, first_row_;
  std::vector<double, Unwritten<Eigen::aligned_allocator<double>>> columns_, blocks_;
  std::vector<double> offsets_, right_, coupled_;
  Eigen::MatrixXd schur_;
};

}  // namespace moldloft::geometry
