#include "geometry/stripes/net_equations.hpp"

#include <Eigen/Cholesky>
#include <doctest/doctest.h>

#include <random>

using namespace moldloft::geometry;
using Eigen::Matrix3d, Eigen::MatrixXd, Eigen::Vector2d, Eigen::Vector3d, Eigen::VectorXd;

namespace {

// All 16 functions of a point as one row over the control points, by the recurrence's own definition.
VectorXd row_of(const BSplineSurface& s, const Vector2d& uv) {
  const int nu = static_cast<int>(s.knots_u.size()) - 4, nv = static_cast<int>(s.knots_v.size()) - 4;
  const auto basis = [](const std::vector<double>& t, int i, double at, auto&& self, int p) -> double {
    const bool last = at == t.back() && t[i + 1] == t.back() && t[i] < t.back();
    if (p == 0) return (t[i] <= at && at < t[i + 1]) || last ? 1.0 : 0.0;
    const double a = t[i + p] - t[i], b = t[i + p + 1] - t[i + 1];
    return (a > 0 ? (at - t[i]) / a * self(t, i, at, self, p - 1) : 0.0) +
           (b > 0 ? (t[i + p + 1] - at) / b * self(t, i + 1, at, self, p - 1) : 0.0);
  };
  VectorXd row(nu * nv);
  for (int i = 0; i < nu; ++i) {
    for (int j = 0; j < nv; ++j)
      row[i * nv + j] = basis(s.knots_u, i, uv.x(), basis, 3) * basis(s.knots_v, j, uv.y(), basis, 3);
  }
  return row;
}

}  // namespace

TEST_CASE("the net's equations have the dense solution, coordinates coupled or not, ring kept or free") {
  BSplineSurface surface{{0, 0, 0, 0, 0.2, 0.2, 0.7, 1, 1, 1, 1}, {0, 0, 0, 0, 0.35, 1, 1, 1, 1}, {}, {}, {}};
  std::mt19937 random(4);
  std::uniform_real_distribution<double> unit(0, 1);
  for (auto* net : {&surface.x, &surface.y, &surface.z}) {
    *net = MatrixXd::NullaryExpr(7, 5, [&] { return unit(random); });
  }
  for (const bool turned : {false, true}) {
    if (turned) {  // the longer direction along v
      std::swap(surface.knots_u, surface.knots_v);
      for (auto* net : {&surface.x, &surface.y, &surface.z}) net->transposeInPlace();
    }
    const int nu = surface.control_u(), nv = surface.control_v();
    for (const bool keep : {false, true}) {
      for (const int block : {1, 3}) {
        NetEquations equations(surface.knots_u, surface.knots_v, keep, block);
        MatrixXd dense = MatrixXd::Zero(3 * nu * nv, 3 * nu * nv);
        VectorXd right = VectorXd::Zero(3 * nu * nv);
        for (int k = 0; k < 300; ++k) {
          const Vector2d uv(k == 0 ? 1.0 : unit(random), k == 1 ? 0.0 : unit(random));
          const Vector3d n(unit(random), unit(random) - 0.5, unit(random));
          const Matrix3d weight = block == 1 ? Matrix3d(unit(random) * Matrix3d::Identity())
                                             : Matrix3d(n * n.transpose() + 0.1 * Matrix3d::Identity());
          const Vector3d load(unit(random), unit(random), unit(random));
          equations.add(live_basis(surface, uv), weight, load);
          const VectorXd row = row_of(surface, uv);
          for (int p = 0; p < 3; ++p) {
            right.segment(p * nu * nv, nu * nv) -= load[p] * row;
            for (int q = 0; q < 3; ++q)
              dense.block(p * nu * nv, q * nu * nv, nu * nv, nu * nv) += weight(p, q) * row * row.transpose();
          }
        }
        // Control points that are kept do not move.
        if (keep) {
          for (int i = 0; i < nu; ++i) {
            for (int j = 0; j < nv; ++j) {
              if (i > 0 && j > 0 && i < nu - 1 && j < nv - 1) continue;
              for (int p = 0; p < 3; ++p) {
                const int at = p * nu * nv + i * nv + j;
                dense.row(at).setZero(), dense.col(at).setZero();
                dense(at, at) = 1, right[at] = 0;
              }
            }
          }
        }
        REQUIRE(equations.solve());
        BSplineSurface moved = surface;
        equations.add_solution_to(moved);
        const Eigen::LDLT<MatrixXd> factor(dense);
        const VectorXd truth = factor.solve(right);
        // Both solve to eps times the condition.
        const double condition = 1 / factor.rcond(),
                     allowed = 100 * 2.3e-16 * condition * truth.cwiseAbs().maxCoeff();
        const MatrixXd BSplineSurface::*const nets[3] = {&BSplineSurface::x, &BSplineSurface::y,
                                                         &BSplineSurface::z};
        for (int p = 0; p < 3; ++p) {
          const MatrixXd move = moved.*nets[p] - surface.*nets[p];
          for (int i = 0; i < nu; ++i) {
            for (int j = 0; j < nv; ++j)
              CHECK(std::abs(move(i, j) - truth[p * nu * nv + i * nv + j]) <= allowed + 1e-15);
          }
        }
      }
    }
  }
}

TEST_CASE("the fairing energy is the integral of the squared second derivatives") {
  // With no data but one heavy point each at the four corners and the middle, the faired net of x, y, z is
  // the one of least energy through them; instead of that the energy itself is compared here: the net that
  // the equations move by a tiny step from `base` goes along minus its gradient.
  BSplineSurface base{{0, 0, 0, 0, 0.3, 1, 1, 1, 1}, {0, 0, 0, 0, 0.5, 0.6, 1, 1, 1, 1}, {}, {}, {}};
  std::mt19937 random(8);
  std::normal_distribution<double> normal;
  for (auto* net : {&base.x, &base.y, &base.z})
    *net = MatrixXd::NullaryExpr(5, 6, [&] { return normal(random); });
  const double length_u = 3, length_v = 2;
  const auto energy = [&](const BSplineSurface& s) {  // of z, by a fine midpoint rule with Richardson's step
    const auto rule = [&](int n) {
      double sum = 0;
      for (int i = 0; i < n; ++i) {
        for (int j = 0; j < n; ++j) {
          const SurfacePoint p = s.at((i + 0.5) / n, (j + 0.5) / n);
          const double xx = p.duu.z() / (length_u * length_u), xy = p.duv.z() / (length_u * length_v),
                       yy = p.dvv.z() / (length_v * length_v);
          sum += xx * xx + 2 * xy * xy + yy * yy;
        }
      }
      return sum / (n * n) * std::pow(length_u * length_v, 2);
    };
    return (4 * rule(200) - rule(100)) / 3;
  };
  // A unit weight on every control point would be the identity; a dense set of points does nearly the same
  // job, so the solution is compared through the optimality condition instead: gradient of points' sum = -
  // factor * gradient of energy.
  NetEquations equations(base.knots_u, base.knots_v, false, 1);
  std::uniform_real_distribution<double> unit(0, 1);
  std::vector<Vector2d> at;
  for (int k = 0; k < 400; ++k) at.emplace_back(unit(random), unit(random));
  for (const Vector2d& uv : at) equations.add(live_basis(base, uv), Matrix3d::Identity(), Vector3d::Zero());
  const double factor = 0.01;
  equations.add_fairing(factor, length_u, length_v, base);
  REQUIRE(equations.solve());
  BSplineSurface faired = base;
  equations.add_solution_to(faired);
  const auto total = [&](const BSplineSurface& s) {
    double sum = factor * energy(s);
    for (const Vector2d& uv : at)
      sum += std::pow((s.at(uv.x(), uv.y()).value - base.at(uv.x(), uv.y()).value).z(), 2);
    return sum;
  };
  const double least = total(faired);
  CHECK(least < total(base));
  for (int i = 0; i < 5; ++i) {
    for (int j = 0; j < 6; ++j) {
      // The total is a parabola in each control point, and its vertex is at the solution.
      BSplineSurface less = faired, more = faired;
      less.z(i, j) -= 0.1, more.z(i, j) += 0.1;
      const double low = total(less) - least, high = total(more) - least;
      CHECK(low > 0);
      CHECK(high > 0);
      CHECK(std::abs(low - high) < 1e-3 * (low + high));  // the midpoint rule's own error
    }
  }
}
