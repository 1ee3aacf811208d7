#include "geometry/splines/bezier.hpp"

#include "geometry/splines/bernstein.hpp"
#include "geometry/splines/tensor_point.hpp"

#include <algorithm>
#include <array>
#include <cassert>

namespace moldloft::geometry {

namespace {

// Values, first and second derivatives, `degree + 1` of each.
using BasisToSecond = std::array<double, 3 * (most_bernstein_degree + 1)>;

void fill_to_second(int degree, double t, BasisToSecond& basis) {
  assert(degree <= most_bernstein_degree);
  basis.fill(0);
  for (int order = 0; order <= std::min(2, degree); ++order) {
    double* row = basis.data() + order * (degree + 1);
    row[0] = 1;
    for (int k = 0; k < degree - order; ++k) raise_bernstein(row, k, t);
    for (int m = degree - order + 1; m <= degree; ++m) {  // d/dt B_i^m = m (B_{i-1}^{m-1} - B_i^{m-1})
      for (int i = m; i > 0; --i) row[i] = m * (row[i - 1] - (i < m ? row[i] : 0.0));
      row[0] *= -m;
    }
  }
}

}  // namespace

template <int dim>
CurvePoint<dim> BezierCurve<dim>::at(double t) const {
  using Point = Eigen::Matrix<double, dim, 1>;
  const int n = degree();
  assert(n >= 0 && n <= most_bernstein_degree);
  std::array<Point, most_bernstein_degree + 1> p;
  for (int i = 0; i <= n; ++i) p[i] = control.row(i).transpose();
  CurvePoint<dim> point{Point::Zero(), Point::Zero(), Point::Zero()};
  for (int left = n; left > 0; --left) {  // the last rows of the triangle hold the derivatives as differences
    if (left == 2) point.second = (n - 1) * n * ((p[2] - p[1]) - (p[1] - p[0]));
    if (left == 1) point.first = n * (p[1] - p[0]);
    for (int i = 0; i < left; ++i) p[i] = (1 - t) * p[i] + t * p[i + 1];
  }
  point.value = p[0];
  return point;
}

SurfacePoint BezierSurface::at(double u, double v) const {
  BasisToSecond bu, bv;
  fill_to_second(degree_u(), u, bu);
  fill_to_second(degree_v(), v, bv);
  return tensor_point({bu.data(), degree_u() + 1}, {bv.data(), degree_v() + 1}, x, y, z, 0, 0);
}

template <int dim>
SplitBezier<dim> split(const BezierCurve<dim>& curve, double t) {
  const SplitForm halves = split_form(curve.control, t);
  return {{halves.left}, {halves.right}};
}

template <int dim>
BezierCurve<dim> elevate(const BezierCurve<dim>& curve, int degree) {
  return {elevate_form(curve.control, degree)};
}

template <int dim>
BezierCurve<dim> restrict_to(const BezierCurve<dim>& curve, double a, double b) {
  return {restrict_form(curve.control, a, b)};
}

BezierSurface elevate(const BezierSurface& surface, int degree_u, int degree_v) {
  const Eigen::MatrixXd along_u = elevation_matrix(surface.degree_u(), degree_u);
  const Eigen::MatrixXd along_v = elevation_matrix(surface.degree_v(), degree_v).transpose();
  return {along_u * surface.x * along_v, along_u * surface.y * along_v, along_u * surface.z * along_v};
}

BezierSurface restrict_to(const BezierSurface& surface, const ParameterBox& box) {
  const Eigen::MatrixXd along_u = restrict_bernstein(surface.degree_u(), box.begin_u, box.end_u).transpose();
  const Eigen::MatrixXd along_v = restrict_bernstein(surface.degree_v(), box.begin_v, box.end_v);
  return {along_u * surface.x * along_v, along_u * surface.y * along_v, along_u * surface.z * along_v};
}

template <int dim>
std::vector<BezierPiece<dim>> bezier_pieces(const BSplineCurve<dim>& curve) {
  const int p = curve.degree;
  std::vector<BezierPiece<dim>> pieces;
  for (const int k : filled_spans(curve.knots, p)) {
    const double begin = curve.knots[k], end = curve.knots[k + 1];
    Eigen::Matrix<double, Eigen::Dynamic, dim> local(p + 1, dim);
    for (int i = 0; i <= p; ++i) local.row(i) = curve.control[k - p + i].transpose();
    pieces.push_back({begin, end, {piece_extraction(curve.knots, p, k, begin, end).transpose() * local}});
  }
  return pieces;
}

std::vector<BezierPatch> bezier_patches(const BSplineSurface& surface) {
  const int p = surface.degree_u, q = surface.degree_v;
  struct Span {
    int first;  // control point
    double begin, end;
    Eigen::MatrixXd extraction;
  };
  const auto spans_of = [](const std::vector<double>& knots, int degree) {
    std::vector<Span> spans;
    for (const int k : filled_spans(knots, degree)) {
      spans.push_back(
          {k - degree, knots[k], knots[k + 1], piece_extraction(knots, degree, k, knots[k], knots[k + 1])});
    }
    return spans;
  };
  const auto along_u = spans_of(surface.knots_u, p), along_v = spans_of(surface.knots_v, q);
  std::vector<BezierPatch> patches;
  for (const Span& v : along_v) {
    for (const Span& u : along_u) {
      const auto piece = [&](const Eigen::MatrixXd& net) -> Eigen::MatrixXd {
        return u.extraction.transpose() * net.block(u.first, v.first, p + 1, q + 1) * v.extraction;
      };
      patches.push_back(
          {{u.begin, u.end, v.begin, v.end}, {piece(surface.x), piece(surface.y), piece(surface.z)}});
    }
  }
  return patches;
}

#define MOLDLOFT_CURVES_OF(dim)                                                   \
  template struct BezierCurve<dim>;                                               \
  template SplitBezier<dim> split(const BezierCurve<dim>&, double);               \
  template BezierCurve<dim> elevate(const BezierCurve<dim>&, int);                \
  template BezierCurve<dim> restrict_to(const BezierCurve<dim>&, double, double); \
  template std::vector<BezierPiece<dim>> bezier_pieces(const BSplineCurve<dim>&);
MOLDLOFT_CURVES_OF(1)
MOLDLOFT_CURVES_OF(2)
MOLDLOFT_CURVES_OF(3)
#undef MOLDLOFT_CURVES_OF

}  // namespace moldloft::geometry
