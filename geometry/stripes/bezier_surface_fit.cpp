#include "geometry/stripes/bezier_surface_fit.hpp"

#include "geometry/stripes/matching_checks.hpp"
#include "geometry/stripes/stripe_matching.hpp"

#include <Eigen/Cholesky>
#include <Eigen/QR>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace moldloft::geometry {

namespace {

std::expected<void, MatchingFailure> check(std::span<const BezierStripe> stripes,
                                           const BezierFitSettings& settings) {
  const auto blame = [](Error what, std::size_t stripe) {
    return std::unexpected(MatchingFailure{.error = what, .stripe = static_cast<int>(stripe)});
  };
  constexpr double rounding = 1e-12;
  const auto inside = [](double x) { return x >= -rounding && x <= 1 + rounding; };
  std::vector<Eigen::Vector2d> from, to;
  for (std::size_t s = 0; s < stripes.size(); ++s) {
    const auto& [control, a, b] = stripes[s];
    if (!control.allFinite() || !a.allFinite() || !b.allFinite()) return blame(Error::not_finite, s);
    if (control.rows() < 1 || control.rows() > settings.degree_u + settings.degree_v + 1)
      return blame(Error::too_few_points, s);
    for (const Eigen::Vector2d& end : {a, b})
      if (!inside(end.x()) || !inside(end.y())) return blame(Error::preimage_outside, s);
    if (!((b - a).norm() > rounding)) return blame(Error::no_length, s);
    from.push_back(a), to.push_back(b);
  }
  if (const auto [first, second] = find_coincident(from, to, nearest_stripes); second >= 0)
    return std::unexpected(MatchingFailure{Error::coincident_stripes, second, first});
  return {};
}

// Largest and smallest singular value of an upper triangular matrix by some steps of (inverse) power
// iteration from a fixed start: the quotient is never above the condition, and soon close to it.
double condition_of(const Eigen::MatrixXd& triangle) {
  const auto r = triangle.triangularView<Eigen::Upper>();
  constexpr int steps = 12;
  Eigen::VectorXd x(triangle.cols());
  for (Eigen::Index i = 0; i < x.size(); ++i) x[i] = std::cos(1.0 + 2.0 * static_cast<double>(i));
  Eigen::VectorXd y = x;
  double largest = 0, inverse = 0;
  for (int step = 0; step < steps; ++step) {
    x = r.transpose() * Eigen::VectorXd(r * x.normalized());
    largest = x.norm();
    y = r.solve(r.transpose().solve(y.normalized()).eval());
    inverse = y.norm();
  }
  const double condition = std::sqrt(largest * inverse);
  return std::isfinite(condition) ? condition : std::numeric_limits<double>::infinity();
}

// The column that the others explain best: it comes last when columns are chosen by what is left of them.
int free_column(const Eigen::MatrixXd& triangle) {
  const Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(triangle);
  return qr.colsPermutation().indices()[triangle.cols() - 1];
}

}  // namespace

void matching_matrix(int degree_u, int degree_v, std::span<const BezierStripe> stripes,
                     Eigen::MatrixXd& matrix) {
  const Eigen::Index rows = degree_u + degree_v + 1;
  matrix.resize(rows * static_cast<Eigen::Index>(stripes.size()), (degree_u + 1) * (degree_v + 1));
  for (std::size_t s = 0; s < stripes.size(); ++s)
    fill_matching_rows(degree_u, degree_v, stripes[s].from, stripes[s].to,
                       matrix.middleRows(static_cast<Eigen::Index>(s) * rows, rows));
}

std::expected<BezierSurfaceFit, MatchingFailure> fit_bezier_surface(std::span<const BezierStripe> stripes,
                                                                    const BezierFitSettings& settings) {
  if (const auto good = check(stripes, settings); !good) return std::unexpected(good.error());
  const int nv = settings.degree_v + 1, control_count = (settings.degree_u + 1) * nv;
  const int raised = settings.degree_u + settings.degree_v;
  const bool ring_given = settings.boundary.rows() > 0;
  if (ring_given && settings.boundary.rows() != control_count)
    return std::unexpected(MatchingFailure{.error = Error::too_few_points});
  if (!settings.boundary.allFinite()) return std::unexpected(MatchingFailure{.error = Error::not_finite});

  std::vector<Eigen::Index> unknown;  // columns that are solved for
  for (int i = 0; i <= settings.degree_u; ++i)
    for (int j = 0; j < nv; ++j)
      if (!ring_given || (i > 0 && i < settings.degree_u && j > 0 && j + 1 < nv))
        unknown.push_back(i * nv + j);
  const auto unknowns = static_cast<Eigen::Index>(unknown.size());
  BezierSurfaceFit fit;
  fit.unknowns = static_cast<int>(unknowns);
  fit.equations = static_cast<int>(stripes.size()) * (raised + 1);
  if (fit.equations < fit.unknowns) return std::unexpected(MatchingFailure{.error = Error::too_few_stripes});

  Eigen::MatrixXd matrix;
  matching_matrix(settings.degree_u, settings.degree_v, stripes, matrix);
  Eigen::MatrixX3d data(matrix.rows(), 3);
  for (std::size_t s = 0; s < stripes.size(); ++s)
    data.middleRows(static_cast<Eigen::Index>(s) * (raised + 1), raised + 1) =
        matching_side(stripes[s].control, raised);

  fit.control = Eigen::MatrixX3d::Zero(control_count, 3);
  if (ring_given) {
    fit.control = settings.boundary;
    for (const Eigen::Index column : unknown) fit.control.row(column).setZero();
  }
  if (unknowns > 0) {
    const Eigen::MatrixX3d side = data - matrix * fit.control;
    const Eigen::MatrixXd unknown_part = ring_given ? Eigen::MatrixXd(matrix(Eigen::all, unknown)) : matrix;
    const auto singular = [&](const Eigen::MatrixXd& triangle) {
      const int column = static_cast<int>(unknown[free_column(triangle)]);
      return std::unexpected(MatchingFailure{
          .error = Error::singular, .control = {column / nv, column % nv}, .condition = fit.condition});
    };
    Eigen::MatrixX3d found;
    Eigen::MatrixXd triangle;
    if (settings.method == LeastSquares::qr) {
      const Eigen::HouseholderQR<Eigen::MatrixXd> qr(unknown_part);
      triangle = qr.matrixQR().topRows(unknowns).triangularView<Eigen::Upper>();
      found = qr.solve(side);
    } else {
      Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(unknowns, unknowns);
      normal.selfadjointView<Eigen::Lower>().rankUpdate(unknown_part.transpose());
      const Eigen::LLT<Eigen::MatrixXd> llt(normal);
      if (llt.info() != Eigen::Success) return singular(normal.selfadjointView<Eigen::Lower>());
      triangle = llt.matrixU();
      found = llt.solve(unknown_part.transpose() * side);
    }
    fit.condition = condition_of(triangle);
    const double hopeless = 1 / (std::numeric_limits<double>::epsilon() * static_cast<double>(matrix.rows()));
    if (!(fit.condition < hopeless) || !found.allFinite()) return singular(triangle);
    for (Eigen::Index n = 0; n < unknowns; ++n) fit.control.row(unknown[n]) = found.row(n);
  }
  const Eigen::VectorXd miss = (matrix * fit.control - data).rowwise().norm();
  fit.rms_mm = std::sqrt(miss.squaredNorm() / static_cast<double>(miss.size()));
  fit.max_mm = miss.maxCoeff();
  return fit;
}

}  // namespace moldloft::geometry
