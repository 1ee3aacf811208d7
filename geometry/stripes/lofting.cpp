#include "geometry/stripes/lofting.hpp"

#include "geometry/splines/curve_fit.hpp"
#include "geometry/splines/derived_curves.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace moldloft::geometry {

namespace {

std::unexpected<Flaw> failed(Error error, std::ptrdiff_t where) {
  return std::unexpected(Flaw{error, static_cast<std::size_t>(where)});
}

std::expected<void, Flaw> check_together(std::span<const SpaceCurve> curves) {
  for (std::size_t k = 0; k < curves.size(); ++k) {
    const auto where = static_cast<std::ptrdiff_t>(k);
    if (const auto checked = check(curves[k]); !checked) return failed(checked.error(), where);
    if (curves[k].degree != curves[0].degree || curves[k].knots != curves[0].knots)
      return failed(Error::curves_not_compatible, where);
  }
  return {};
}

// A curve's control points as one right side: x, y, z of the first, of the second, ...
std::span<const double> coordinates(const SpaceCurve& curve) {
  return {curve.control.front().data(), 3 * curve.control.size()};
}

void measure(Loft& loft, std::span<const SpaceCurve> curves) {
  double squares = 0;
  for (std::size_t k = 0; k < curves.size(); ++k) {
    const SpaceCurve line = line_along_v(loft.surface, loft.parameters[k]);
    for (std::size_t j = 0; j < line.control.size(); ++j) {
      const double distance = (line.control[j] - curves[k].control[j]).norm();
      squares += distance * distance;
      loft.max = std::max(loft.max, distance);
    }
  }
  loft.rms = std::sqrt(squares / static_cast<double>(curves.size() * curves[0].control.size()));
}

}  // namespace

std::expected<std::vector<double>, Flaw> loft_parameters(std::span<const SpaceCurve> curves) {
  if (curves.size() < 2) return failed(Error::too_few_points, std::ssize(curves));
  std::vector<double> mean(curves.size(), 0.0);
  int rows = 0;
  for (const bool last : {false, true}) {
    const auto point = [&](std::size_t k) {
      return last ? curves[k].control.back() : curves[k].control.front();
    };
    std::vector<double> chord(curves.size(), 0.0);
    for (std::size_t k = 1; k < curves.size(); ++k)
      chord[k] = chord[k - 1] + (point(k) - point(k - 1)).norm();
    if (!std::isfinite(chord.back())) return failed(Error::not_finite, 0);
    if (chord.back() == 0) continue;
    ++rows;
    for (std::size_t k = 0; k < curves.size(); ++k) mean[k] += chord[k] / chord.back();
  }
  for (std::size_t k = 0; k < curves.size(); ++k) {
    if (rows > 0) mean[k] /= rows;
    if (k > 0 && !(mean[k] > mean[k - 1]))
      return failed(Error::coincident_curves, static_cast<std::ptrdiff_t>(k));
  }
  return mean;
}

std::expected<Loft, Flaw> loft(std::span<const SpaceCurve> curves, const LoftSettings& settings) {
  const int count = static_cast<int>(curves.size());
  const int control_points = settings.control_points > 0 ? settings.control_points : count;
  if (count <= settings.degree || count < control_points) return failed(Error::too_few_points, count);
  if (const auto checked = check_together(curves); !checked) return std::unexpected(checked.error());
  const auto parameters = loft_parameters(curves);
  if (!parameters) return std::unexpected(parameters.error());
  if (control_points <= settings.degree) return failed(Error::too_few_points, control_points);
  return loft(curves, *parameters, balanced_knots(*parameters, control_points, settings.degree), settings);
}

std::expected<Loft, Flaw> loft(std::span<const SpaceCurve> curves, std::span<const double> parameters,
                               std::span<const double> knots_u, const LoftSettings& settings) {
  if (curves.size() != parameters.size()) return failed(Error::sizes_differ, std::ssize(parameters));
  const int degree = settings.degree, control_u = static_cast<int>(knots_u.size()) - degree - 1;
  if (const auto checked = check_knots(knots_u, degree, control_u); !checked)
    return failed(checked.error(), 0);
  if (std::ssize(curves) < control_u) return failed(Error::too_few_points, std::ssize(curves));
  if (const auto checked = check_together(curves); !checked) return std::unexpected(checked.error());
  for (std::size_t k = 0; k < parameters.size(); ++k) {
    const auto where = static_cast<std::ptrdiff_t>(k);
    if (!std::isfinite(parameters[k])) return failed(Error::not_finite, where);
    if (k > 0 && !(parameters[k] > parameters[k - 1])) return failed(Error::coincident_curves, where);
    if (parameters[k] < knots_u.front() || parameters[k] > knots_u.back())
      return failed(Error::outside_domain, where);
  }

  // [N] [R] = [C]: one equation a curve, one right side a coordinate of its control points (2.75, 2.82). Rows
  // [first, end) of the net are sought.
  const int first = settings.interpolate_ends ? 1 : 0, end = control_u - first;
  if (const int lonely = first_without_parameter(knots_u, degree, parameters, first, end); lonely != end)
    return failed(Error::span_without_points, lonely);
  const auto width = static_cast<int>(coordinates(curves[0]).size());
  BandedLeastSquares system(end - first, degree + 1, width);
  std::array<double, most_spline_degree + 1> basis;
  Eigen::VectorXd right(width);
  using Coordinates = Eigen::Map<const Eigen::VectorXd>;
  for (std::size_t k = 0; k < curves.size(); ++k) {
    const int span = find_span(knots_u, parameters[k], degree);
    basis_functions(knots_u, degree, span, parameters[k], basis);
    right = Coordinates(coordinates(curves[k]).data(), width);
    int low = span - degree, high = span + 1;
    if (low < first) right -= basis[0] * Coordinates(coordinates(curves.front()).data(), width), ++low;
    if (high > end) right -= basis[degree] * Coordinates(coordinates(curves.back()).data(), width), --high;
    const std::span sought{basis.data() + (low - (span - degree)),
                           static_cast<std::size_t>(std::max(high - low, 0))};
    system.add(low - first, sought, {right.data(), static_cast<std::size_t>(width)});
  }
  const Pivots pivots = system.pivots();
  const auto solution = system.solve();
  if (!solution) return failed(solution.error(), first + pivots.weakest);

  const Eigen::Index control_v = width / 3;
  Loft loft{{{knots_u.begin(), knots_u.end()},
             curves[0].knots,
             Eigen::MatrixXd(control_u, control_v),
             Eigen::MatrixXd(control_u, control_v),
             Eigen::MatrixXd(control_u, control_v),
             degree,
             curves[0].degree},
            {parameters.begin(), parameters.end()}};
  loft.pivots = pivots;
  for (int i = 0; i < control_u; ++i) {
    const SpaceCurve& kept = i < first ? curves.front() : curves.back();
    for (Eigen::Index j = 0; j < control_v; ++j) {
      Eigen::Vector3d p = kept.control[j];
      if (i >= first && i < end) p = solution->block<1, 3>(i - first, 3 * j).transpose();
      loft.surface.x(i, j) = p.x(), loft.surface.y(i, j) = p.y(), loft.surface.z(i, j) = p.z();
    }
  }
  measure(loft, curves);
  return loft;
}

}  // namespace moldloft::geometry
