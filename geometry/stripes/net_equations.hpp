// Normal equations of a bicubic net over any clamped knots, whose control points' coordinates may be coupled:
// what a fit needs that weighs a residual differently in different directions of space.
//
// Minimises sum_k S(u_k)' Q_k S(u_k) + 2 S(u_k)' l_k over the free control points, S the surface of the
// unknowns; for residuals r_k that S is to take away l_k = Q_k r_k. With block 1 the weights Q are multiples
// of the identity and the three coordinates share one matrix; with block 3 they are symmetric 3 x 3 matrices.
//
// Cost         add: 136 block^2 multiply-adds a point; solve: see band_cholesky.hpp, half band block (3 n +
//              4) - 1 for n free control points in the shorter direction
// Allocation   in the constructor only
// Failure      solve() returns false where a pivot is not positive
#pragma once

#include "geometry/splines/band_cholesky.hpp"
#include "geometry/splines/bspline.hpp"

#include <Eigen/Core>

#include <array>
#include <span>
#include <vector>

namespace moldloft::geometry {

// The 4 + 4 basis functions that live at (u, v).
struct LiveBasis {
  int first_u, first_v;  // the first control point of the 4 x 4
  std::array<double, 4> u, v;
};
LiveBasis live_basis(const BSplineSurface&, const Eigen::Vector2d& uv);

class NetEquations {
 public:
  // `keep_border`: the outer ring of control points is no unknown.
  NetEquations(const std::vector<double>& knots_u, const std::vector<double>& knots_v, bool keep_border,
               int block);

  int unknowns() const { return free_u_ * free_v_; }  // control points
  void clear();
  void add(const LiveBasis&, const Eigen::Matrix3d& weight, const Eigen::Vector3d& load);
  // The thin-plate energy of every coordinate of S + `base`, on a sheet of length_u x length_v.
  void add_fairing(double factor, double length_u, double length_v, const BSplineSurface& base);
  double fairing_trace(double length_u, double length_v) const;
  double trace() const { return trace_; }  // of the matrix so far, one coordinate

  bool solve();
  // The unknowns, added to the free control points of `surface`.
  void add_solution_to(BSplineSurface& surface) const;
  double smallest_pivot() const { return matrix_.smallest_pivot(); }
  double largest_pivot() const { return matrix_.largest_pivot(); }

 private:
  // Integrals over one span of products of its live functions' derivatives of order 0, 1, 2.
  using SpanRoughness = std::array<Eigen::Matrix4d, 3>;
  static std::vector<SpanRoughness> roughness(const std::vector<double>& knots);
  template <typename Visit>
  void for_each_energy_cell(double length_u, double length_v, const Visit& visit) const;
  int place(int i, int j) const;  // -1 where the control point is no unknown

  int border_, control_u_, control_v_, free_u_, free_v_, block_;
  std::vector<SpanRoughness> rough_u_, rough_v_;
  BandCholesky matrix_;
  std::vector<double> right_;  // block 3: coordinates interleaved; block 1: one coordinate after the other
  double trace_ = 0;
};

}  // namespace moldloft::geometry
