// Least distance programming: the shortest z with G z >= h, for few unknowns and any number of constraints.
//
// Source       Lawson and Hanson, Solving Least Squares Problems (1974), chapter 23: the dual is a
//              nonnegative least squares problem on the columns (g_i, h_i), solved by their active-set method
//              (same chapter, NNLS)
// Shapes       `rows` holds m rows of 6 numbers (zeros for fewer unknowns), `bounds` holds h; `open` (empty,
//              or one a row) leaves out rows where it is 0
// Accuracy     no constraint is broken by more than 1e-11 of the largest |h| or of |z|; rows should be of the
//              order of 1
// Cost         O(m) for each of some ten exchanges
// Allocation   none
// Failure      std::nullopt where the constraints contradict one another
#pragma once

#include <Eigen/Core>

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

namespace moldloft::geometry {

using Vector6 = Eigen::Matrix<double, 6, 1, Eigen::DontAlign>;

struct ActiveRow {
  std::size_t row = 0;
  double multiplier = 0;  // z = sum multiplier * g_row, none of them negative
};

struct LeastDistance {
  Vector6 z = Vector6::Zero();
  std::array<ActiveRow, 7> active{};
  int active_count = 0;
};

std::optional<LeastDistance> least_distance(std::span<const std::array<double, 6>> rows,
                                            std::span<const double> bounds,
                                            std::span<const std::uint8_t> open = {});

}  // namespace moldloft::geometry
