#include "geometry/splines/bspline.hpp"

#include "geometry/splines/tensor_point.hpp"

#include <algorithm>
#include <array>
#include <cassert>
#include <cstring>

namespace moldloft::geometry {

namespace {

using BasisToSecond = std::array<double, 3 * (most_spline_degree + 1)>;

// Two doubles side by side: what every 64-bit machine has registers for, so that one order of
// summation serves all.
using Pair [[gnu::vector_size(16)]] = double;

Pair first_of(Pair a, Pair b) { return __builtin_shufflevector(a, b, 0, 2); }
Pair second_of(Pair a, Pair b) { return __builtin_shufflevector(a, b, 1, 3); }
Pair load(const double* from) {
  Pair p;
  std::memcpy(&p, from, sizeof p);
  return p;
}
void store(double* to, Pair p) { std::memcpy(to, &p, sizeof p); }

// Four numbers along u: control points, or basis functions.
struct Four {
  Pair low, high;
};
// The sums a . w and b . w side by side; the four products of either are added (0 + 2) + (1 + 3).
Pair dots(const Four& a, const Four& b, const Four& w) {
  const Pair pa = a.low * w.low + a.high * w.high, pb = b.low * w.low + b.high * w.high;
  return first_of(pa, pb) + second_of(pa, pb);
}
Pair dots(const Four& a, const Four& wa, const Four& b, const Four& wb) {
  const Pair pa = a.low * wa.low + a.high * wa.high, pb = b.low * wb.low + b.high * wb.high;
  return first_of(pa, pb) + second_of(pa, pb);
}

// The rows of a bicubic patch summed along v: with the values of the basis there, its first,
// its second derivatives.
struct SummedAlongV {
  Four value, first, second;
};

[[gnu::always_inline]] inline SummedAlongV sum_along_v(const double* patch, std::ptrdiff_t stride,
                                                       const CubicRow<Pair>& along_v) {
  SummedAlongV sums;
  const auto column = [&](int j, auto&& put) {
    const Pair low = load(patch + j * stride), high = load(patch + j * stride + 2);
    put(sums.value.low, along_v.value[j] * low), put(sums.value.high, along_v.value[j] * high);
    put(sums.first.low, along_v.first[j] * low), put(sums.first.high, along_v.first[j] * high);
    put(sums.second.low, along_v.second[j] * low), put(sums.second.high, along_v.second[j] * high);
  };
  column(0, [](Pair& sum, Pair term) { sum = term; });
  for (int j = 1; j < 4; ++j) column(j, [](Pair& sum, Pair term) { sum += term; });
  return sums;
}

SurfacePoint bicubic_at(const BSplineSurface& s, int ku, double u, int kv, double v) {
  Pair knot[6];  // lanes: u, v
  for (int i = 0; i < 6; ++i) knot[i] = Pair{s.knots_u[ku - 2 + i], s.knots_v[kv - 2 + i]};
  const CubicRow<Pair> basis = cubic_row(knot, Pair{u, v});
  const auto along_u = [](const Pair(&of)[4]) {
    return Four{first_of(of[0], of[1]), first_of(of[2], of[3])};
  };
  CubicRow<Pair> along_v;  // lanes: v, v
  for (int j = 0; j < 4; ++j) {
    along_v.value[j] = second_of(basis.value[j], basis.value[j]);
    along_v.first[j] = second_of(basis.first[j], basis.first[j]);
    along_v.second[j] = second_of(basis.second[j], basis.second[j]);
  }
  const Four value = along_u(basis.value), first = along_u(basis.first), second = along_u(basis.second);

  const std::ptrdiff_t stride = s.x.rows(), corner = ku - cubic + (kv - cubic) * stride;
  const SummedAlongV x = sum_along_v(s.x.data() + corner, stride, along_v);
  const SummedAlongV y = sum_along_v(s.y.data() + corner, stride, along_v);
  const SummedAlongV z = sum_along_v(s.z.data() + corner, stride, along_v);

  SurfacePoint point;
  store(point.value.data(), dots(x.value, y.value, value));
  store(point.du.data(), dots(x.value, y.value, first));
  store(point.duu.data(), dots(x.value, y.value, second));
  store(point.dv.data(), dots(x.first, y.first, value));
  store(point.duv.data(), dots(x.first, y.first, first));
  store(point.dvv.data(), dots(x.second, y.second, value));
  const Pair z1 = dots(z.value, value, z.value, first), z2 = dots(z.value, second, z.first, value),
             z3 = dots(z.first, first, z.second, value);
  point.value.data()[2] = z1[0], point.du.data()[2] = z1[1];
  point.duu.data()[2] = z2[0], point.dv.data()[2] = z2[1];
  point.duv.data()[2] = z3[0], point.dvv.data()[2] = z3[1];
  return point;
}

SurfacePoint any_degree_at(const BSplineSurface& s, int ku, double u, int kv, double v) {
  BasisToSecond bu, bv;
  basis_derivatives(s.knots_u, s.degree_u, ku, u, 2, bu);
  basis_derivatives(s.knots_v, s.degree_v, kv, v, 2, bv);
  const TensorBasis along_u{bu.data(), s.degree_u + 1}, along_v{bv.data(), s.degree_v + 1};
  return tensor_point(along_u, along_v, s.x, s.y, s.z, ku - s.degree_u, kv - s.degree_v);
}

}  // namespace

double refined_coefficient(std::span<const double> coarse, std::span<const double> coefficients,
                           std::span<const double> fine, int i) {
  // De Boor's triangle with a different argument at every level evaluates the blossom of the piece
  // that lies there.
  const int k = find_span(coarse, 0.5 * (fine[i + 1] + fine[i + 3]));
  std::array<double, 4> d;
  for (int j = 0; j <= cubic; ++j) d[j] = coefficients[k - cubic + j];
  for (int level = 1; level <= cubic; ++level) {
    const double t = fine[i + level];
    for (int j = cubic; j >= level; --j) {
      const double low = coarse[k - cubic + j], high = coarse[k + 1 + j - level];
      const double share = (t - low) / (high - low);
      d[j] = (1 - share) * d[j - 1] + share * d[j];
    }
  }
  return d[cubic];
}

template <int dim>
CurvePoint<dim> BSplineCurve<dim>::at(double t) const {
  t = std::clamp(t, begin(), end());
  const int k = find_span(knots, t, degree);
  const Point* p = &control[k - degree];
  CurvePoint<dim> point{Point::Zero(), Point::Zero(), Point::Zero()};
  const auto add = [&](int i, double value, double first, double second) {
    point.value += value * p[i], point.first += first * p[i], point.second += second * p[i];
  };
  if (degree == cubic) {
    const BasisValues basis = cubic_basis(knots, k, t);
    for (int i = 0; i <= cubic; ++i) add(i, basis.value[i], basis.first[i], basis.second[i]);
    return point;
  }
  BasisToSecond basis;
  basis_derivatives(knots, degree, k, t, 2, basis);
  const int width = degree + 1;
  for (int i = 0; i < width; ++i) add(i, basis[i], basis[width + i], basis[2 * width + i]);
  return point;
}

template <int dim>
typename BSplineCurve<dim>::Point BSplineCurve<dim>::de_boor(double t) const {
  t = std::clamp(t, begin(), end());
  const int k = find_span(knots, t, degree);
  std::array<Point, most_spline_degree + 1> d;
  std::copy_n(control.begin() + (k - degree), degree + 1, d.begin());
  for (int level = 1; level <= degree; ++level) {
    for (int j = degree; j >= level; --j) {
      const double low = knots[k - degree + j], high = knots[k + 1 + j - level];
      d[j] = ((high - t) / (high - low)) * d[j - 1] + ((t - low) / (high - low)) * d[j];
    }
  }
  return d[degree];
}

template struct BSplineCurve<1>;
template struct BSplineCurve<2>;
template struct BSplineCurve<3>;

SurfacePoint BSplineSurface::at(double u, double v) const {
  u = std::clamp(u, knots_u[degree_u], knots_u[knots_u.size() - degree_u - 1]);
  v = std::clamp(v, knots_v[degree_v], knots_v[knots_v.size() - degree_v - 1]);
  const int ku = find_span(knots_u, u, degree_u), kv = find_span(knots_v, v, degree_v);
  return bicubic() ? bicubic_at(*this, ku, u, kv, v) : any_degree_at(*this, ku, u, kv, v);
}

template <int dim>
std::expected<void, Error> check(const BSplineCurve<dim>& curve) {
  if (const auto knots = check_knots(curve.knots, curve.degree, static_cast<int>(curve.control.size()));
      !knots)
    return knots;
  for (const auto& point : curve.control)
    if (!point.allFinite()) return std::unexpected(Error::not_finite);
  return {};
}
template std::expected<void, Error> check(const BSplineCurve<1>&);
template std::expected<void, Error> check(const BSplineCurve<2>&);
template std::expected<void, Error> check(const BSplineCurve<3>&);

std::expected<void, Error> check(const BSplineSurface& surface) {
  if (const auto knots = check_knots(surface.knots_u, surface.degree_u, surface.control_u()); !knots)
    return knots;
  if (const auto knots = check_knots(surface.knots_v, surface.degree_v, surface.control_v()); !knots)
    return knots;
  for (const Eigen::MatrixXd* net : {&surface.x, &surface.y, &surface.z}) {
    if (net->rows() != surface.x.rows() || net->cols() != surface.x.cols())
      return std::unexpected(Error::knots_wrong_count);
    if (!net->allFinite()) return std::unexpected(Error::not_finite);
  }
  return {};
}

}  // namespace moldloft::geometry
