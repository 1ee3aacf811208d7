#include "geometry/splines/knots.hpp"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <numeric>

namespace moldloft::geometry {

namespace {

std::vector<double> clamped(double begin, double end, int degree, std::span<const double> interior) {
  std::vector<double> knots(static_cast<std::size_t>(degree) + 1, begin);
  knots.insert(knots.end(), interior.begin(), interior.end());
  knots.insert(knots.end(), static_cast<std::size_t>(degree) + 1, end);
  return knots;
}

}  // namespace

std::vector<double> uniform_clamped_knots(int spans, int degree) {
  assert(spans >= 1 && degree >= 0);
  std::vector<double> interior(static_cast<std::size_t>(spans) - 1);
  for (int i = 1; i < spans; ++i) interior[i - 1] = static_cast<double>(i) / spans;
  return clamped(0, 1, degree, interior);
}

std::expected<void, Error> check_knots(std::span<const double> knots, int degree, int control_points) {
  assert(degree >= 0 && degree <= most_spline_degree);
  const int n = static_cast<int>(knots.size());
  if (control_points <= degree || n != control_points + degree + 1)
    return std::unexpected(Error::knots_wrong_count);
  if (!std::ranges::all_of(knots, [](double t) { return std::isfinite(t); }))
    return std::unexpected(Error::not_finite);
  if (!std::ranges::is_sorted(knots)) return std::unexpected(Error::knots_not_increasing);
  if (knots[0] != knots[degree] || knots[n - 1 - degree] != knots[n - 1] || !(knots[0] < knots[n - 1]))
    return std::unexpected(Error::knots_not_clamped);
  const int most = std::max(degree, 1);  // of knots in one place, but for the ends' degree + 1
  for (int i = 0; i + most < n; ++i) {
    const bool at_end = degree > 0 && (knots[i] == knots[0] ? i == 0 : i + most == n - 1);
    if (knots[i] == knots[i + most] && !at_end) return std::unexpected(Error::knot_too_often);
  }
  return {};
}

std::expected<void, Error> check_cubic_knots(std::span<const double> knots) {
  return check_knots(knots, cubic, static_cast<int>(knots.size()) - cubic - 1);
}

int search_span(std::span<const double> knots, double t, int degree) {
  const int last = static_cast<int>(knots.size()) - degree - 2;
  if (!(t > knots[degree])) return degree;
  if (t >= knots[last + 1]) {  // the last span that is not empty
    int k = last;
    while (k > degree && knots[k] >= knots[k + 1]) --k;
    return k;
  }
  const auto above = std::upper_bound(knots.begin() + degree, knots.begin() + last + 1, t);
  return static_cast<int>(above - knots.begin()) - 1;
}

int multiplicity(std::span<const double> knots, double t) {
  const auto [first, end] = std::ranges::equal_range(knots, t);
  return static_cast<int>(end - first);
}

std::vector<int> filled_spans(std::span<const double> knots, int degree) {
  std::vector<int> filled;
  for (int k = degree; k + degree + 1 < static_cast<int>(knots.size()); ++k)
    if (knots[k] < knots[k + 1]) filled.push_back(k);
  return filled;
}

double greville(std::span<const double> knots, int i, int degree) {
  assert(degree >= 1);
  double sum = knots[i + 1];
  for (int j = 2; j <= degree; ++j) sum += knots[i + j];
  return sum / degree;
}

std::vector<double> merge_knots(std::span<const std::vector<double>> all, double tolerance) {
  std::vector<double> values;
  for (const auto& knots : all) values.insert(values.end(), knots.begin(), knots.end());
  std::ranges::sort(values);
  std::vector<double> merged;
  for (auto first = values.begin(); first != values.end();) {
    const double value = *first;
    first = std::upper_bound(first, values.end(), value + tolerance);
    std::ptrdiff_t often = 0;
    for (const auto& knots : all) {
      const auto low = std::ranges::lower_bound(knots, value);
      often = std::max(often, std::ranges::upper_bound(knots, value + tolerance) - low);
    }
    merged.insert(merged.end(), static_cast<std::size_t>(often), value);
  }
  return merged;
}

std::vector<double> merge_knots(std::vector<double> a, std::vector<double> b, double tolerance) {
  const std::array both{std::move(a), std::move(b)};
  return merge_knots(both, tolerance);
}

std::vector<double> snap_knots(std::span<const double> knots, std::span<const double> onto,
                               double tolerance) {
  std::vector<double> snapped(knots.begin(), knots.end());
  for (double& t : snapped) {
    const auto above = std::ranges::lower_bound(onto, t);
    const double* nearest = above == onto.end() ? &onto.back() : &*above;
    if (above != onto.begin() && t - *(above - 1) < std::abs(*nearest - t)) nearest = &*(above - 1);
    if (std::abs(*nearest - t) <= tolerance) t = *nearest;
  }
  return snapped;
}

std::vector<double> averaged_knots(std::span<const double> parameters, int degree) {
  const int count = static_cast<int>(parameters.size());
  assert(degree >= 1 && count > degree);
  std::vector<double> interior;
  for (int j = 1; j + degree < count; ++j) {
    const auto run = parameters.subspan(j, degree);
    interior.push_back(std::accumulate(run.begin(), run.end(), 0.0) / degree);
  }
  return clamped(parameters.front(), parameters.back(), degree, interior);
}

std::vector<double> balanced_knots(std::span<const double> parameters, int control_points, int degree) {
  const int count = static_cast<int>(parameters.size());
  assert(degree >= 1 && degree < control_points && control_points <= count);
  if (control_points == count) return averaged_knots(parameters, degree);
  const double stride = static_cast<double>(count) / (control_points - degree);
  std::vector<double> interior;
  for (int j = 1; j < control_points - degree; ++j) {
    const int i = static_cast<int>(j * stride);
    const double share = j * stride - i;
    interior.push_back((1 - share) * parameters[i - 1] + share * parameters[i]);
  }
  return clamped(parameters.front(), parameters.back(), degree, interior);
}

}  // namespace moldloft::geometry
