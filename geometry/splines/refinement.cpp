#include "geometry/splines/refinement.hpp"

#include <algorithm>
#include <array>
#include <cassert>
#include <iterator>

namespace moldloft::geometry {

namespace {

// Control points as rows of a matrix, and back.
template <int dim>
Eigen::MatrixXd rows_of(const BSplineCurve<dim>& curve) {
  Eigen::MatrixXd rows(static_cast<Eigen::Index>(curve.control.size()), dim);
  for (Eigen::Index i = 0; i < rows.rows(); ++i) rows.row(i) = curve.control[i].transpose();
  return rows;
}

template <int dim>
BSplineCurve<dim> curve_of(std::vector<double> knots, const Eigen::MatrixXd& rows, int degree) {
  BSplineCurve<dim> curve{std::move(knots), {}, degree};
  curve.control.resize(static_cast<std::size_t>(rows.rows()));
  for (Eigen::Index i = 0; i < rows.rows(); ++i) curve.control[i] = rows.row(i).transpose();
  return curve;
}

// A surface's net as rows along u, the three axes side by side; and back.
Eigen::MatrixXd rows_along_u(const BSplineSurface& s) {
  Eigen::MatrixXd rows(s.x.rows(), 3 * s.x.cols());
  rows << s.x, s.y, s.z;
  return rows;
}

void take_rows_along_u(BSplineSurface& s, const Eigen::MatrixXd& rows) {
  const Eigen::Index n = rows.cols() / 3;
  s.x = rows.leftCols(n), s.y = rows.middleCols(n, n), s.z = rows.rightCols(n);
}

BSplineSurface transposed(const BSplineSurface& s) {
  return {s.knots_v, s.knots_u, s.x.transpose(), s.y.transpose(), s.z.transpose(), s.degree_v, s.degree_u};
}

// Where a curve over these knots is cut at t: the knots of both halves, and the control point
// that they share.
struct Cut {
  std::vector<double> left, right;
  int shared;
};

Cut cut_at(const std::vector<double>& full, [[maybe_unused]] int degree, double t) {
  const auto [first, end] = std::ranges::equal_range(full, t);
  assert(end - first == degree && first != full.begin() && end != full.end());
  Cut cut{{full.begin(), end}, {first, full.end()}, static_cast<int>(first - full.begin()) - 1};
  cut.left.push_back(t);
  cut.right.insert(cut.right.begin(), t);
  return cut;
}

}  // namespace

SplineCoefficients insert_knot(std::span<const double> knots, int degree, const Eigen::MatrixXd& rows,
                               double t) {
  assert(knots.front() < t && t < knots.back() && multiplicity(knots, t) <= degree);
  assert(rows.rows() + degree + 1 == static_cast<Eigen::Index>(knots.size()));
  const int k = find_span(knots, t, degree);
  SplineCoefficients out{{knots.begin(), knots.end()}, Eigen::MatrixXd(rows.rows() + 1, rows.cols())};
  out.knots.insert(std::ranges::upper_bound(out.knots, t), t);
  const int changed = k - degree + 1;  // rows before it stay, rows from k on move up by one
  out.rows.topRows(changed) = rows.topRows(changed);
  out.rows.bottomRows(rows.rows() - k) = rows.bottomRows(rows.rows() - k);
  for (int i = changed; i <= k; ++i) {  // (2.64); the quotients are 0 or 1 where the knot stands already
    const double low = knots[i], high = knots[i + degree], length = high - low;
    out.rows.row(i) = (high - t) / length * rows.row(i - 1) + (t - low) / length * rows.row(i);
  }
  return out;
}

Eigen::MatrixXd refine_coefficients(std::span<const double> knots, int degree, const Eigen::MatrixXd& rows,
                                    std::span<const double> fine) {
  assert(std::ranges::includes(fine, knots));
  std::vector<double> missing;
  std::ranges::set_difference(fine, knots, std::back_inserter(missing));
  SplineCoefficients now{{knots.begin(), knots.end()}, rows};
  for (const double t : missing) now = insert_knot(now.knots, degree, now.rows, t);
  return now.rows;
}

Eigen::MatrixXd refinement_matrix(std::span<const double> knots, int degree, std::span<const double> fine) {
  const Eigen::Index n = static_cast<Eigen::Index>(knots.size()) - degree - 1;
  return refine_coefficients(knots, degree, Eigen::MatrixXd::Identity(n, n), fine);
}

SplineCoefficients elevate_coefficients(std::span<const double> knots, int degree,
                                        const Eigen::MatrixXd& rows) {
  // Control point i of the raised spline is the blossom of degree + 1 at raised knots i + 1 ... i + degree +
  // 1, and that is the mean of the old blossom over all ways to leave one of these out. Leaving out the knot
  // t gives control points of the old spline refined to all raised knots but t.
  std::vector<double> distinct{knots.begin(), knots.end()};
  distinct.erase(std::unique(distinct.begin(), distinct.end()), distinct.end());
  std::vector<double> interior{knots.begin() + degree + 1, knots.end() - degree - 1};
  interior.insert(interior.end(), distinct.begin() + 1, distinct.end() - 1);
  std::ranges::sort(interior);

  SplineCoefficients raised;
  const auto clamped = [&](const std::vector<double>& inner, int often) {
    std::vector<double> all(static_cast<std::size_t>(often), distinct.front());
    all.insert(all.end(), inner.begin(), inner.end());
    all.insert(all.end(), static_cast<std::size_t>(often), distinct.back());
    return all;
  };
  raised.knots = clamped(interior, degree + 2);
  const int count = static_cast<int>(raised.knots.size()) - degree - 2;
  raised.rows = Eigen::MatrixXd::Zero(count, rows.cols());
  for (const double t : distinct) {
    std::vector<double> inner = interior;
    if (const auto at = std::ranges::lower_bound(inner, t); at != inner.end() && *at == t) inner.erase(at);
    const Eigen::MatrixXd refined = refine_coefficients(knots, degree, rows, clamped(inner, degree + 1));
    // These knots have one fewer in front than the raised ones less t, unless t itself is the front.
    const int shift = t == distinct.front() ? 0 : 1;
    for (int i = 0; i < count; ++i) {
      const auto first = raised.knots.begin() + i + 1;
      const auto often = std::count(first, first + degree + 1, t);
      if (often == 0) continue;
      const Eigen::Index row = std::clamp<Eigen::Index>(i - shift, 0, refined.rows() - 1);
      raised.rows.row(i) += static_cast<double>(often) / (degree + 1) * refined.row(row);
    }
  }
  return raised;
}

std::vector<double> with_full_knot(std::span<const double> knots, int degree, double t) {
  std::vector<double> full{knots.begin(), knots.end()};
  const int missing = std::max(degree - multiplicity(knots, t), 0);
  full.insert(std::ranges::upper_bound(full, t), static_cast<std::size_t>(missing), t);
  return full;
}

template <int dim>
BSplineCurve<dim> refine(const BSplineCurve<dim>& curve, std::span<const double> fine) {
  const Eigen::MatrixXd rows = refine_coefficients(curve.knots, curve.degree, rows_of(curve), fine);
  return curve_of<dim>({fine.begin(), fine.end()}, rows, curve.degree);
}

template <int dim>
BSplineCurve<dim> elevate(const BSplineCurve<dim>& curve, int degree) {
  assert(degree >= curve.degree && degree <= most_spline_degree);
  SplineCoefficients now{curve.knots, rows_of(curve)};
  for (int d = curve.degree; d < degree; ++d) now = elevate_coefficients(now.knots, d, now.rows);
  return curve_of<dim>(std::move(now.knots), now.rows, degree);
}

template <int dim>
SplitCurve<dim> split(const BSplineCurve<dim>& curve, double t) {
  const BSplineCurve<dim> full = refine(curve, with_full_knot(curve.knots, curve.degree, t));
  Cut cut = cut_at(full.knots, curve.degree, t);
  const auto shared = full.control.begin() + cut.shared;
  return {{std::move(cut.left), {full.control.begin(), shared + 1}, curve.degree},
          {std::move(cut.right), {shared, full.control.end()}, curve.degree}};
}

template <int dim>
BSplineCurve<dim> reversed(const BSplineCurve<dim>& curve) {
  BSplineCurve<dim> back{curve.knots, {curve.control.rbegin(), curve.control.rend()}, curve.degree};
  for (std::size_t i = 0; i < curve.knots.size(); ++i) {
    const double t = curve.knots[curve.knots.size() - 1 - i];
    back.knots[i] = t == curve.knots.back()    ? curve.knots.front()
                    : t == curve.knots.front() ? curve.knots.back()
                                               : curve.knots.front() + (curve.knots.back() - t);
  }
  return back;
}

template <int dim>
void make_compatible(BSplineCurve<dim>& a, BSplineCurve<dim>& b, double tolerance) {
  const int degree = std::max(a.degree, b.degree);
  for (BSplineCurve<dim>* curve : {&a, &b}) *curve = elevate(*curve, degree);
  const std::vector<double> merged = merge_knots(a.knots, b.knots, tolerance);
  for (BSplineCurve<dim>* curve : {&a, &b}) {
    if (tolerance > 0) curve->knots = snap_knots(curve->knots, merged, tolerance);
    *curve = refine(*curve, merged);
  }
}

#define MOLDLOFT_CURVES_OF(dim)                                                         \
  template BSplineCurve<dim> refine(const BSplineCurve<dim>&, std::span<const double>); \
  template BSplineCurve<dim> elevate(const BSplineCurve<dim>&, int);                    \
  template SplitCurve<dim> split(const BSplineCurve<dim>&, double);                     \
  template BSplineCurve<dim> reversed(const BSplineCurve<dim>&);                        \
  template void make_compatible(BSplineCurve<dim>&, BSplineCurve<dim>&, double);
MOLDLOFT_CURVES_OF(1)
MOLDLOFT_CURVES_OF(2)
MOLDLOFT_CURVES_OF(3)
#undef MOLDLOFT_CURVES_OF

BSplineSurface refine(const BSplineSurface& surface, std::span<const double> fine_u,
                      std::span<const double> fine_v) {
  const auto along_u = [](const BSplineSurface& s, std::span<const double> fine) {
    BSplineSurface out{{fine.begin(), fine.end()}, s.knots_v, {}, {}, {}, s.degree_u, s.degree_v};
    take_rows_along_u(out, refine_coefficients(s.knots_u, s.degree_u, rows_along_u(s), fine));
    return out;
  };
  return transposed(along_u(transposed(along_u(surface, fine_u)), fine_v));
}

BSplineSurface elevate(const BSplineSurface& surface, int degree_u, int degree_v) {
  assert(degree_u >= surface.degree_u && degree_v >= surface.degree_v);
  const auto along_u = [](const BSplineSurface& s, int degree) {
    SplineCoefficients now{s.knots_u, rows_along_u(s)};
    for (int d = s.degree_u; d < degree; ++d) now = elevate_coefficients(now.knots, d, now.rows);
    BSplineSurface out{std::move(now.knots), s.knots_v, {}, {}, {}, degree, s.degree_v};
    take_rows_along_u(out, now.rows);
    return out;
  };
  return transposed(along_u(transposed(along_u(surface, degree_u)), degree_v));
}

SplitSurface split_u(const BSplineSurface& surface, double u) {
  const int degree = surface.degree_u;
  const BSplineSurface full = refine(surface, with_full_knot(surface.knots_u, degree, u), surface.knots_v);
  Cut cut = cut_at(full.knots_u, degree, u);
  const Eigen::MatrixXd rows = rows_along_u(full);
  SplitSurface halves{{std::move(cut.left), full.knots_v, {}, {}, {}, degree, full.degree_v},
                      {std::move(cut.right), full.knots_v, {}, {}, {}, degree, full.degree_v}};
  take_rows_along_u(halves.low, rows.topRows(cut.shared + 1));
  take_rows_along_u(halves.high, rows.bottomRows(rows.rows() - cut.shared));
  return halves;
}

SplitSurface split_v(const BSplineSurface& surface, double v) {
  const SplitSurface halves = split_u(transposed(surface), v);
  return {transposed(halves.low), transposed(halves.high)};
}

}  // namespace moldloft::geometry
