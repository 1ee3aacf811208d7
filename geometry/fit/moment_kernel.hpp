// The inner loops of the surface fit: a block of points to Bernstein values, values to moments,
// halves to wholes.
//
// Stage 1 (lanes over points): cell, local coordinates, cubic and sextic Bernstein values of every point of
// a block. Stage 2 (lanes over entries): over each run of consecutive points in one cell, with the cell's 7
// x 8 + 4 x 4 sums in registers, one rank-1 update a point.
//
// Accuracy     every entry is a plain sum in the order of the points, so that the bits do not depend on the
//              variant, nor on how a stream of points is cut into blocks
// Cost         3-6 ns a point with AVX-512 or AVX2 while stripes stay in their cells; a run costs some
//              10 ns more
// Allocation   none
#pragma once

#include "geometry/fit/cell_moments.hpp"
#include "geometry/simd.hpp"

#include <cstddef>
#include <cstdint>

namespace moldloft::geometry {

// Up to `capacity` points on their way from columns to moments; small enough for the first-level cache.
struct PointBlock {
  static constexpr int capacity = 128;  // a multiple of 8

  // In: what locate() fills, or the caller for nets that are not uniform. s and t are local, 0..1.
  alignas(64) double s[capacity], t[capacity], height[capacity], weight[capacity];
  alignas(64) std::int32_t cell[capacity];
  int count = 0;
  bool weighted = false;  // false: every weight is 1 and weight[] is not read
  bool shot_rows_wanted = false;

  // Out of values(): the factors of the rank-1 updates.
  alignas(64) double gram_rows[7][capacity];     // w B6_p(s)
  alignas(64) double load_rows[4][capacity];     // w z B3_i(s)
  alignas(64) double shot_rows[4][capacity];     // w B3_i(s)
  alignas(64) double gram_columns[capacity][8];  // B6_q(t), and z^2
  alignas(64) double load_columns[capacity][4];  // B3_j(t)
};

// Columns to cells of equal size: the whole part of (raw - origin) * scale; the last cell holds its end.
struct UniformCells {
  int cells_u = 1, cells_v = 1;
  double scale_u = 1, scale_v = 1;  // cells per unit of the columns
  double origin_u = 0, origin_v = 0;
};

struct MomentKernel {
  Simd simd;
  // Fills s, t and cell from `count` coordinates; height (and weight, if weighted) must be there. False
  // when a point lies outside the grid or is not finite: those are put at a cell's corner, so that
  // memory stays safe.
  bool (*locate)(PointBlock&, const double* u, const double* v, const UniformCells&);
  void (*values)(PointBlock&);
  // Adds all points of the block; `counts` (one a cell) may be null.
  void (*fold)(const PointBlock&, CellMoments* cells, std::uint32_t* counts);
  // The sums of w B3_i(s) B3_j(t) over the points [first, end), which lie in one cell.
  void (*fold_shot)(const PointBlock&, int first, int end, double* sixteen);
  // The surface at every point, from its cell's 4 x 4 Bezier coefficients; the block is not weighted, its
  // shot rows wanted.
  void (*heights)(const PointBlock&, const std::array<double, 16>* bezier, double* out);
  // One cell from its halves, [u half][v half]; a direction that is not halved passes null for
  // its second halves.
  void (*merge)(const CellMoments* const halves[4], CellMoments& whole);
  // The Gram matrix of the 16 functions that live on a cell, as SplineNet lays it out (CellMatrix): moments
  // in rows of eight, the slow direction's products of two functions, those of the fast direction turned.
  void (*cell_gram)(const double* gram, const double (*slow)[8], const double (*fast)[16], double* out);
};

// The variant asked for; it must be one that machine_has().
const MomentKernel& moment_kernel(Simd = widest_simd());

}  // namespace moldloft::geometry
