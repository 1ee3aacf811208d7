#include "geometry/fit/fit_checks.hpp"

#include <Eigen/Core>

#include <algorithm>
#include <bit>
#include <cmath>

namespace moldloft::geometry {

namespace {

// Less than this share of how far the points stand from zero holds too few doubles for the knots of a net.
constexpr double least_extent = 1e-9;

// Squared thickness of points on one line, relative to the domain's square: what rounding leaves of the sums.
constexpr double no_thickness = 1e-14;

std::unexpected<Flaw> failed(Error error, std::size_t where = 0) {
  return std::unexpected(Flaw{error, where});
}

std::expected<void, Flaw> check_domain(const FitDomain& d) {
  if (!std::isfinite(d.min_u) || !std::isfinite(d.max_u) || !std::isfinite(d.min_v) ||
      !std::isfinite(d.max_v))
    return failed(Error::not_finite);
  const auto has_extent = [](double low, double high) {
    const double extent = high - low, size = std::max(std::abs(low), std::abs(high));
    return extent > least_extent * size && std::isfinite(most_cells / extent) && std::isfinite(extent);
  };
  if (!has_extent(d.min_u, d.max_u) || !has_extent(d.min_v, d.max_v)) return failed(Error::no_extent);
  return {};
}

std::expected<void, Flaw> check_boundary(const FitSettings& settings, Eigen::Index control_u,
                                         Eigen::Index control_v, bool chosen) {
  const Eigen::MatrixXd& control = settings.boundary.control;
  if (control.size() == 0) return {};
  if (chosen) return failed(Error::impossible_setting);
  if (control.rows() != control_u || control.cols() != control_v) return failed(Error::sizes_differ);
  if (!(settings.boundary.weight > 0)) return failed(Error::negative_weight);
  for (Eigen::Index i = 0; i < control_u; ++i) {
    for (Eigen::Index j = 0; j < control_v; ++j) {
      const bool ring = i == 0 || j == 0 || i == control_u - 1 || j == control_v - 1;
      if (ring && !std::isfinite(control(i, j)))
        return failed(Error::not_finite, static_cast<std::size_t>(i * control_v + j));
    }
  }
  return {};
}

}  // namespace

std::expected<void, Flaw> check_settings(const FitSettings& settings) {
  const FairingSettings& fairing = settings.fairing;
  if (!(settings.tolerance >= 0) || !(fairing.everywhere >= 0) || !(fairing.where_sparse >= 0) ||
      !std::isfinite(fairing.everywhere) || !std::isfinite(fairing.where_sparse) ||
      settings.robust_passes < 0)
    return failed(Error::impossible_setting);
  Eigen::Index control_u = settings.control_u, control_v = settings.control_v;
  const bool knots = !settings.knots_u.empty() || !settings.knots_v.empty();
  const bool chosen = !knots && control_u == 0 && control_v == 0;
  if (knots) {
    for (const auto* given : {&settings.knots_u, &settings.knots_v}) {
      if (const auto good = check_net_knots(*given); !good) return good;
    }
    control_u = std::ssize(settings.knots_u) - cubic - 1,
    control_v = std::ssize(settings.knots_v) - cubic - 1;
  } else if (const auto good = check_domain(settings.domain); !good) {
    return good;
  } else if (chosen) {
    if (settings.finest_spans < fewest_spans ||
        !std::has_single_bit(static_cast<unsigned>(settings.finest_spans)))
      return failed(Error::impossible_setting);
    control_u = control_v = settings.finest_spans;
  } else if (control_u <= cubic || control_v <= cubic) {
    return failed(Error::impossible_setting);
  }
  if (control_u > most_cells / control_v) return failed(Error::capacity);
  return check_boundary(settings, control_u, control_v, chosen);
}

std::expected<void, Flaw> check_sums(const PointColumns& columns, const PointTotals& totals, double datum) {
  if (std::isfinite(totals.squares) && std::isfinite(totals.weight)) return {};
  // The datum is one of the points' heights: where that one is the large one, it is the one to blame.
  std::size_t worst = 0;
  double most = -1;
  for (std::size_t i = 0; i < columns.size(); ++i) {
    const double weight = columns.weight.empty() ? 1 : columns.weight[i];
    const double size =
        std::sqrt(weight) * std::max(std::abs(columns.z[i]), std::abs(columns.z[i] - datum) / 2);
    if (size > most) most = size, worst = i;
  }
  return failed(Error::too_large, worst);
}

std::expected<void, Flaw> check_spread(const SplineNet& net, const MomentGrid& grid) {
  const SpanTable &u = net.spans_u(), &v = net.spans_v();
  const double first_u = u[0].begin, length_u = u[u.spans() - 1].end - first_u;
  const double first_v = v[0].begin, length_v = v[v.spans() - 1].end - first_v;
  double weight = 0;
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  Eigen::Matrix2d square = Eigen::Matrix2d::Zero();
  for (int i = 0; i < grid.cells_u(); ++i) {
    for (int j = 0; j < grid.cells_v(); ++j) {
      if (grid.points(i, j) == 0) continue;
      // s and s^2 of the cell as sextics: their Bernstein coefficients are p / 6 and p (p - 1) / 30.
      double w = 0, s = 0, t = 0, ss = 0, st = 0, tt = 0;
      const auto& gram = grid.cell(i, j).gram;
      for (int p = 0; p < 7; ++p) {
        for (int q = 0; q < 7; ++q) {
          const double m = gram[static_cast<std::size_t>(p * 8 + q)];
          w += m, s += m * p / 6, t += m * q / 6;
          ss += m * p * (p - 1) / 30, st += m * p * q / 36, tt += m * q * (q - 1) / 30;
        }
      }
      const double a = (u[i].begin - first_u) / length_u, h = (u[i].end - u[i].begin) / length_u;
      const double b = (v[j].begin - first_v) / length_v, k = (v[j].end - v[j].begin) / length_v;
      weight += w;
      sum += Eigen::Vector2d(a * w + h * s, b * w + k * t);
      square(0, 0) += a * a * w + 2 * a * h * s + h * h * ss;
      square(0, 1) += a * b * w + a * k * t + b * h * s + h * k * st;
      square(1, 1) += b * b * w + 2 * b * k * t + k * k * tt;
    }
  }
  if (!(weight > 0)) return failed(Error::too_few_points);
  const Eigen::Vector2d mean = sum / weight;
  const double uu = square(0, 0) / weight - mean[0] * mean[0], uv = square(0, 1) / weight - mean[0] * mean[1],
               vv = square(1, 1) / weight - mean[1] * mean[1];
  const double thin = 0.5 * (uu + vv - std::hypot(uu - vv, 2 * uv));
  if (!(thin > no_thickness)) return failed(Error::collinear);
  return {};
}

}  // namespace moldloft::geometry
