// A net of bicubic B-splines over equal spans, seen cell by cell: how Bernstein moments become normal
// equations.
//
// On a cell 4 x 4 basis functions live. Each is a bicubic in Bernstein form (Bezier extraction), so a product of two
// is a bisextic, and every entry of the cell's 16 x 16 Gram matrix is a fixed combination of its 7 x 7 moments.
//
// Cost         a cell 2,000 multiply-adds for the Gram matrix, as many for the fairing
// Allocation   in the constructor only
#pragma once

#include <array>
#include <span>
#include <vector>

#include "geometry/splines/band_cholesky.hpp"
#include "geometry/fit/cell_moments.hpp"

namespace moldloft::geometry {

// One direction: for every span what its four live functions are made of.
class SpanTable {
 public:
  explicit SpanTable(int spans);

  struct Span {
    std::array<std::array<double, 4>, 4> extraction;              // [a][i]: N_a = sum_i extraction B3_i
    std::array<std::array<std::array<double, 7>, 4>, 4> product;  // [a][b][p]: N_a N_b = sum_p product B6_p
    std::array<std::array<std::array<double, 4>, 4>, 3>
        roughness;  // [order][a][b]: integral of N_a^(k) N_b^(k)
  };
  int spans() const { return static_cast<int>(table_.size()); }
  const Span& operator[](int k) const { return table_[k]; }
  std::size_t bytes() const { return table_.capacity() * sizeof(Span); }

 private:
  std::vector<Span> table_;
};

using CellMatrix = std::array<std::array<double, 16>, 16>;  // functions a * 4 + c, a along u, c along v
using CellVector = std::array<double, 16>;

class SplineNet {
 public:
  SplineNet(int spans_u, int spans_v);

  int control_u() const { return u_.spans() + 3; }
  int control_v() const { return v_.spans() + 3; }
  int unknowns() const { return control_u() * control_v(); }
  int half_band() const { return 3 * std::min(control_u(), control_v()) + 3; }
  // The unknown's place in the equations: the shorter direction runs fastest, so that the band is narrow.
  int index(int i, int j) const {
    return control_v() <= control_u() ? i * control_v() + j : j * control_u() + i;
  }

  CellMatrix gram(int cell_u, int cell_v, const CellMoments&) const;
  CellVector load(int cell_u, int cell_v, std::span<const double, 16> moments) const;
  // The thin-plate energy of one cell as a quadratic form, for a plate of the given lengths (mm).
  CellMatrix fairing(int cell_u, int cell_v, double length_u, double length_v) const;

  void add_to(BandCholesky&, int cell_u, int cell_v, const CellMatrix&, double factor) const;
  void add_to(std::span<double> vector, int cell_u, int cell_v, const CellVector&) const;
  // The 16 coefficients that live on a cell.
  CellVector gather(std::span<const double> coefficients, int cell_u, int cell_v) const;

  std::size_t bytes() const { return u_.bytes() + v_.bytes(); }

 private:
  SpanTable u_, v_;
};

}  // namespace moldloft::geometry
