#include "geometry/stripes/stripe_matching.hpp"

#include "geometry/splines/bernstein.hpp"
#include "geometry/splines/bernstein_form.hpp"

#include <array>
#include <cassert>

namespace moldloft::geometry {

void fill_matching_rows(int degree_u, int degree_v, const Eigen::Vector2d& from, const Eigen::Vector2d& to,
                        Eigen::Ref<Eigen::MatrixXd> rows) {
  const int raised = degree_u + degree_v;
  assert(rows.rows() == raised + 1 && rows.cols() == (degree_u + 1) * (degree_v + 1));

  // Scaled Bernstein coefficients multiply as plain polynomials do: B_l B_q = C C / C(raised, l + q) B_{l+q}.
  Eigen::MatrixXd along_u = restrict_bernstein(degree_u, from.x(), to.x()).transpose();
  Eigen::MatrixXd along_v = restrict_bernstein(degree_v, from.y(), to.y()).transpose();
  for (int l = 0; l <= degree_u; ++l) along_u.row(l) *= binomial(degree_u, l);
  for (int q = 0; q <= degree_v; ++q) along_v.row(q) *= binomial(degree_v, q);
  Eigen::VectorXd scale(raised + 1);
  for (int p = 0; p <= raised; ++p) scale[p] = 1 / binomial(raised, p);

  for (int i = 0; i <= degree_u; ++i) {
    for (int j = 0; j <= degree_v; ++j) {
      auto column = rows.col(i * (degree_v + 1) + j);
      column.setZero();
      for (int l = 0; l <= degree_u; ++l) column.segment(l, degree_v + 1) += along_u(l, i) * along_v.col(j);
      column.array() *= scale.array();
    }
  }
}

Eigen::MatrixX3d matching_side(const Eigen::MatrixX3d& stripe_control, int raised_degree) {
  return elevation_matrix(static_cast<int>(stripe_control.rows()) - 1, raised_degree) * stripe_control;
}

BicubicRows bicubic_rows(const Eigen::Matrix4d& along_u, const Eigen::Matrix4d& along_v) {
  // v's coefficients first: four rows of basis functions, one column a Bernstein coefficient.
  Eigen::Matrix4d scaled_v;
  for (int q = 0; q < 4; ++q) scaled_v.col(q) = binomial3[q] * along_v.col(q);
  BicubicRows rows = BicubicRows::Zero();
  for (int l = 0; l < 4; ++l) {
    for (int q = 0; q < 4; ++q) {
      const double scale = binomial3[l] / binomial6[l + q];
      const Eigen::Vector4d v = scale * scaled_v.col(q);
      for (int i = 0; i < 4; ++i) rows.col(l + q).segment<4>(4 * i) += along_u(i, l) * v;
    }
  }
  return rows;
}

SexticSide sextic_side(const Eigen::Matrix<double, 4, 3>& d) {
  // C(3, p - j) C(3, j) / C(6, p)
  SexticSide g;
  g.row(0) = d.row(0);
  g.row(1) = (d.row(0) + d.row(1)) / 2;
  g.row(2) = (d.row(0) + 3 * d.row(1) + d.row(2)) / 5;
  g.row(3) = (d.row(0) + 9 * d.row(1) + 9 * d.row(2) + d.row(3)) / 20;
  g.row(4) = (d.row(1) + 3 * d.row(2) + d.row(3)) / 5;
  g.row(5) = (d.row(2) + d.row(3)) / 2;
  g.row(6) = d.row(3);
  return g;
}

}  // namespace moldloft::geometry
