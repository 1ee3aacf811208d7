#include "geometry/splines/curve_fit.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>

namespace moldloft::geometry {

namespace {

std::unexpected<Flaw> failed(Error error, std::ptrdiff_t where) {
  return std::unexpected(Flaw{error, static_cast<std::size_t>(where)});
}

template <int dim>
std::optional<Flaw> what_is_wrong(Points<dim> points, std::span<const double> parameters, double begin,
                                  double end) {
  if (points.size() != parameters.size()) return Flaw{Error::sizes_differ};
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (!points[i].allFinite() || !std::isfinite(parameters[i])) return Flaw{Error::not_finite, i};
    if (i > 0 && parameters[i] < parameters[i - 1]) return Flaw{Error::repeated_points, i};
    if (parameters[i] < begin || parameters[i] > end) return Flaw{Error::outside_domain, i};
  }
  return std::nullopt;
}

template <int dim>
void measure(CurveFit<dim>& fit, Points<dim> points) {
  double squares = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const double distance = (fit.curve.value(fit.parameters[i]) - points[i]).norm();
    squares += distance * distance;
    if (distance > fit.max) fit.max = distance, fit.farthest = static_cast<int>(i);
  }
  fit.rms = std::sqrt(squares / static_cast<double>(points.size()));
}

// The fit on balanced knots with so many control points, for data that have been looked at already.
template <int dim>
std::expected<CurveFit<dim>, Flaw> fit_balanced(Points<dim> points, std::span<const double> parameters,
                                                int control_points, const CurveFitSettings& settings) {
  return fit_curve<dim>(points, parameters, balanced_knots(parameters, control_points, settings.degree),
                        settings);
}

template <int dim>
std::optional<Flaw> cannot_choose(Points<dim> points, std::span<const double> parameters, int degree) {
  if (static_cast<int>(points.size()) <= degree) return Flaw{Error::too_few_points, points.size()};
  if (const auto wrong = what_is_wrong<dim>(points, parameters, parameters.front(), parameters.back()))
    return wrong;
  if (!(parameters.front() < parameters.back())) return Flaw{Error::repeated_points, points.size() - 1};
  return std::nullopt;
}

}  // namespace

int first_without_parameter(std::span<const double> knots, int degree, std::span<const double> parameters,
                            int first, int end) {
  // Each control point in turn takes the first parameter where its basis function is not zero and that none
  // before it took; equal parameters are one.
  std::size_t next = 0;
  for (int i = first; i < end; ++i) {
    const double low = knots[i], high = knots[i + degree + 1];
    const bool at_begin = low == knots[i + degree], at_end = high == knots[i + 1];
    while (next < parameters.size() && (at_begin ? parameters[next] < low : parameters[next] <= low)) ++next;
    if (next == parameters.size() || (at_end ? parameters[next] > high : parameters[next] >= high)) return i;
    const double taken = parameters[next];
    while (next < parameters.size() && parameters[next] == taken) ++next;
  }
  return end;
}

template <int dim>
std::expected<std::vector<double>, Flaw> chord_length_parameters(Points<dim> points) {
  if (points.size() < 2) return failed(Error::too_few_points, std::ssize(points));
  std::vector<double> parameters(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (!points[i].allFinite()) return failed(Error::not_finite, static_cast<std::ptrdiff_t>(i));
    if (i == 0) continue;
    const double chord = (points[i] - points[i - 1]).norm();
    if (!(chord > 0)) return failed(Error::repeated_points, static_cast<std::ptrdiff_t>(i));
    parameters[i] = parameters[i - 1] + chord;
  }
  const double length = parameters.back();
  for (double& t : parameters) t /= length;
  return parameters;
}

template <int dim>
std::expected<CurveFit<dim>, Flaw> fit_curve(Points<dim> points, std::span<const double> parameters,
                                             std::span<const double> knots,
                                             const CurveFitSettings& settings) {
  const int degree = settings.degree, control_points = static_cast<int>(knots.size()) - degree - 1;
  if (const auto checked = check_knots(knots, degree, control_points); !checked)
    return failed(checked.error(), 0);
  if (std::ssize(points) < control_points) return failed(Error::too_few_points, std::ssize(points));
  if (const auto wrong = what_is_wrong<dim>(points, parameters, knots.front(), knots.back()))
    return std::unexpected(*wrong);

  // Control points [first, end) are sought; the ends are known if they interpolate.
  const int first = settings.interpolate_ends ? 1 : 0, end = control_points - first;
  if (const int lonely = first_without_parameter(knots, degree, parameters, first, end); lonely != end)
    return failed(Error::span_without_points, lonely);

  BandedLeastSquares system(end - first, degree + 1, dim);
  std::array<double, most_spline_degree + 1> basis;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const int k = find_span(knots, parameters[i], degree);
    basis_functions(knots, degree, k, parameters[i], basis);
    Eigen::Matrix<double, dim, 1> right = points[i];
    int low = k - degree, high = k + 1;
    if (low < first) right -= basis[0] * points.front(), ++low;
    if (high > end) right -= basis[degree] * points.back(), --high;
    const std::span sought{basis.data() + (low - (k - degree)),
                           static_cast<std::size_t>(std::max(high - low, 0))};
    system.add(low - first, sought, {right.data(), dim});
  }
  CurveFit<dim> fit{{{knots.begin(), knots.end()}, {}, degree}, {parameters.begin(), parameters.end()}};
  fit.pivots = system.pivots();
  const auto solution = system.solve();
  if (!solution) return failed(solution.error(), first + fit.pivots.weakest);
  fit.curve.control.resize(static_cast<std::size_t>(control_points));
  if (settings.interpolate_ends)
    fit.curve.control.front() = points.front(), fit.curve.control.back() = points.back();
  for (int i = first; i < end; ++i) fit.curve.control[i] = solution->row(i - first).transpose();
  measure<dim>(fit, points);
  return fit;
}

template <int dim>
std::expected<CurveFit<dim>, Flaw> fit_curve(Points<dim> points, std::span<const double> knots,
                                             const CurveFitSettings& settings) {
  const auto parameters = chord_length_parameters<dim>(points);
  if (!parameters) return std::unexpected(parameters.error());
  return fit_curve<dim>(points, *parameters, knots, settings);
}

template <int dim>
std::expected<CurveFit<dim>, Flaw> fit_curve_within(Points<dim> points, std::span<const double> parameters,
                                                    double tolerance, const CurveFitSettings& settings) {
  if (const auto wrong = cannot_choose<dim>(points, parameters, settings.degree))
    return std::unexpected(*wrong);
  Flaw closest{Error::tolerance_not_met};
  double least = std::numeric_limits<double>::infinity();
  for (int n = settings.degree + 1; n <= static_cast<int>(points.size()); ++n) {
    auto fit = fit_balanced<dim>(points, parameters, n, settings);
    if (!fit) continue;  // parameters too uneven for that many: others may do
    if (fit->max <= tolerance) return fit;
    if (fit->max < least) closest.where = static_cast<std::size_t>(n), least = fit->max;
  }
  return std::unexpected(closest);
}

template <int dim>
std::expected<CurveFit<dim>, Flaw> fit_curve_by_cross_validation(Points<dim> points,
                                                                 std::span<const double> parameters,
                                                                 const CurveFitSettings& settings) {
  if (const auto wrong = cannot_choose<dim>(points, parameters, settings.degree))
    return std::unexpected(*wrong);
  const int count = static_cast<int>(points.size());
  std::expected<CurveFit<dim>, Flaw> best = failed(Error::span_without_points, 0);
  double least = std::numeric_limits<double>::infinity();
  for (int n = settings.degree + 1; n <= std::max(count / 2, settings.degree + 1); ++n) {
    auto fit = fit_balanced<dim>(points, parameters, n, settings);
    if (!fit) continue;
    const double freedom = 1 - static_cast<double>(n) / count;
    const double score = freedom > 0 ? fit->rms * fit->rms / (freedom * freedom) : fit->rms;
    if (score < least) least = score, best = std::move(fit);
  }
  return best;
}

#define MOLDLOFT_FITS_OF(dim)                                                                             \
  template std::expected<std::vector<double>, Flaw> chord_length_parameters<dim>(Points<dim>);            \
  template std::expected<CurveFit<dim>, Flaw> fit_curve<dim>(                                             \
      Points<dim>, std::span<const double>, std::span<const double>, const CurveFitSettings&);            \
  template std::expected<CurveFit<dim>, Flaw> fit_curve<dim>(Points<dim>, std::span<const double>,        \
                                                             const CurveFitSettings&);                    \
  template std::expected<CurveFit<dim>, Flaw> fit_curve_within<dim>(Points<dim>, std::span<const double>, \
                                                                    double, const CurveFitSettings&);     \
  template std::expected<CurveFit<dim>, Flaw> fit_curve_by_cross_validation<dim>(                         \
      Points<dim>, std::span<const double>, const CurveFitSettings&);
MOLDLOFT_FITS_OF(1)
MOLDLOFT_FITS_OF(2)
MOLDLOFT_FITS_OF(3)
#undef MOLDLOFT_FITS_OF

}  // namespace moldloft::geometry
