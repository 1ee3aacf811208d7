#include "geometry/fit/plan_map.hpp"

#include "geometry/fit/plan_map_kernel.hpp"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <limits>

// Curves are assigned into room of the same size: the compiler cannot know.
MOLDLOFT_GEOMETRY_CHECKED_AT_RUN_TIME

namespace moldloft::geometry {

namespace {

constexpr double newton_tolerance_mm = 1e-10;
// In batches a last step follows, which squares what is left: at most its square times the map's second
// derivatives over the square of its first, 1e-6^2 / 100 mm here, far below the tolerance above.
constexpr double batch_tolerance_mm = 1e-6;
// Batches take points as far off the plate as this, in its own lengths.
constexpr double near_plate = 0.5;
constexpr int newton_steps = 25;  // 2-3 are usual; a wild start needs its steps shortened
constexpr double longest_step =
    0.25;  // of the unit square: keeps a wild start inside the map's neighbourhood

constexpr double least_corner_sine = 1e-9;  // between the two sides that meet in a corner

// A side's control point i when the side is walked in the map's direction.
Eigen::Vector2d control(const PlanCurve& side, bool reversed, int i) {
  return reversed ? side.control[side.control.size() - 1 - i] : side.control[i];
}

// The piece of a uniform clamped spline on span k in powers of the span's coordinate, by
// its Taylor coefficients.
std::array<double, 4> powers_on_span(std::span<const double> knots, int k, const std::array<double, 4>& c) {
  const double t = knots[k], h = knots[k + 1] - knots[k];
  const BasisValues at_start = cubic_basis(knots, k, t), at_end = cubic_basis(knots, k, knots[k + 1]);
  double value = 0, first = 0, second = 0, second_end = 0;
  for (int i = 0; i < 4; ++i) {
    value += at_start.value[i] * c[i];
    first += at_start.first[i] * c[i];
    second += at_start.second[i] * c[i];
    second_end += at_end.second[i] * c[i];
  }
  return {value, h * first, 0.5 * h * h * second, h * h * (second_end - second) / 6};
}

}  // namespace

PlanMap::PlanMap(int spans) {
  const auto pieces = static_cast<std::size_t>(spans);
  for (auto& side : outline_.sides) {
    side.knots.reserve(pieces + 2 * cubic + 1);
    side.control.reserve(pieces + cubic);
  }
  along_u_.reserve(pieces);
  along_v_.reserve(pieces);
}

PlanMap::PlanMap(const Outline& outline) : outline_{outline} { tabulate(); }

void PlanMap::assign(const Outline& outline) {
  outline_ = outline;
  tabulate();
}

// The sides as polynomials, span by span.
void PlanMap::tabulate() {
  const std::vector<double>& knots = outline_.sides[0].knots;
  const int spans = static_cast<int>(knots.size()) - 2 * cubic - 1;
  along_u_.resize(spans);
  along_v_.resize(spans);
  const auto fill = [&](std::vector<SpanPair>& pairs, int low, bool low_reversed, int high,
                        bool high_reversed) {
    for (int s = 0; s < spans; ++s) {
      for (int axis = 0; axis < 2; ++axis) {
        std::array<double, 4> low_c, high_c;
        for (int i = 0; i < 4; ++i) {
          low_c[i] = control(outline_.sides[low], low_reversed, s + i)[axis];
          high_c[i] = control(outline_.sides[high], high_reversed, s + i)[axis];
        }
        const auto low_powers = powers_on_span(knots, s + cubic, low_c);
        const auto high_powers = powers_on_span(knots, s + cubic, high_c);
        std::ranges::copy(low_powers, pairs[s].coefficient[axis]);
        std::ranges::copy(high_powers, pairs[s].coefficient[2 + axis]);
      }
    }
  };
  fill(along_u_, 0, false, 2, true);
  fill(along_v_, 3, true, 1, false);
  c00_ = outline_.sides[0].control.front(), c10_ = outline_.sides[0].control.back();
  c11_ = outline_.sides[2].control.front(), c01_ = outline_.sides[2].control.back();
}

PlanMap::PairValue PlanMap::evaluate(const std::vector<SpanPair>& pairs, double t) {
  const double spans = static_cast<double>(pairs.size());
  const double inside = std::clamp(t, 0.0, 1.0);
  const int k = std::min(static_cast<int>(inside * spans), static_cast<int>(pairs.size()) - 1);
  const double s = inside * spans - k, beyond = t - inside;
  std::array<double, 4> value, first;
  for (int c = 0; c < 4; ++c) {
    const auto& p = pairs[k].coefficient[c];
    first[c] = spans * (p[1] + s * (2 * p[2] + s * 3 * p[3]));
    value[c] = p[0] + s * (p[1] + s * (p[2] + s * p[3])) + beyond * first[c];
  }
  return {{value[0], value[1]}, {value[2], value[3]}, {first[0], first[1]}, {first[2], first[3]}};
}

PlanPoint PlanMap::at(double u, double v) const {
  const PairValue pu = evaluate(along_u_, u), pv = evaluate(along_v_, v);
  PlanPoint point;
  point.value = (1 - v) * pu.low + v * pu.high + (1 - u) * pv.low + u * pv.high -
                ((1 - u) * ((1 - v) * c00_ + v * c01_) + u * ((1 - v) * c10_ + v * c11_));
  point.jacobian.col(0) = (1 - v) * pu.low_first + v * pu.high_first + pv.high - pv.low -
                          ((1 - v) * (c10_ - c00_) + v * (c11_ - c01_));
  point.jacobian.col(1) = pu.high - pu.low + (1 - u) * pv.low_first + u * pv.high_first -
                          ((1 - u) * (c01_ - c00_) + u * (c11_ - c10_));
  return point;
}

std::expected<void, Error> PlanMap::check() const {
  for (int row = 0; row < check_rows; ++row) {
    if (const auto good = check_row(row); !good) return good;
  }
  return {};
}

std::expected<void, Error> PlanMap::check_row(int row) const {
  if (row == 0) {
    // A corner of 180 degrees has no Jacobian, and rounding would decide its sign.
    for (const Eigen::Vector2d& corner : {Eigen::Vector2d(0, 0), {1, 0}, {1, 1}, {0, 1}}) {
      const Eigen::Matrix2d jacobian = at(corner.x(), corner.y()).jacobian;
      const double largest = jacobian.col(0).norm() * jacobian.col(1).norm();
      if (!std::isfinite(largest)) return std::unexpected(Error::not_finite);
      if (std::abs(jacobian.determinant()) <= least_corner_sine * largest)
        return std::unexpected(Error::collinear);
    }
  }
  constexpr int grid = check_rows - 1;
  for (int j = 0; j <= grid; ++j) {
    const double area = at(row / double{grid}, j / double{grid}).jacobian.determinant();
    if (!std::isfinite(area)) return std::unexpected(Error::not_finite);
    if (area <= 0) return std::unexpected(Error::folded_map);
  }
  return {};
}

std::expected<Eigen::Vector2d, Error> PlanMap::invert(const Eigen::Vector2d& xy, const Eigen::Vector2d& guess,
                                                      double margin) const {
  if (!xy.allFinite()) return std::unexpected(Error::not_finite);
  const auto from = [&](Eigen::Vector2d uv) -> std::expected<Eigen::Vector2d, Error> {
    for (int step = 0; step < newton_steps; ++step) {
      const PlanPoint point = at(uv.x(), uv.y());
      const Eigen::Vector2d residual = xy - point.value;
      if (residual.squaredNorm() <= newton_tolerance_mm * newton_tolerance_mm) return uv;
      const Eigen::Matrix2d& j = point.jacobian;
      const double det = j(0, 0) * j(1, 1) - j(0, 1) * j(1, 0);
      if (!(std::abs(det) > 1e-12)) break;
      Eigen::Vector2d move(j(1, 1) * residual.x() - j(0, 1) * residual.y(),
                           j(0, 0) * residual.y() - j(1, 0) * residual.x());
      move /= det;
      const double size = std::max(std::abs(move.x()), std::abs(move.y()));
      if (size > longest_step) move *= longest_step / size;
      uv += move;
      if (std::abs(uv.x() - 0.5) > 3 || std::abs(uv.y() - 0.5) > 3)
        break;  // far off: no (u, v) belongs to it
    }
    return std::unexpected(Error::outside_domain);
  };

  auto uv = from(guess.allFinite() ? guess : Eigen::Vector2d(0.5, 0.5));
  if (!uv)
    uv = from({0.5, 0.5});  // a guess from another corner of the plate may lead astray; the middle never did
  if (!uv) return uv;
  const double off = std::max({-uv->x(), -uv->y(), uv->x() - 1, uv->y() - 1});
  if (off > margin + 1e-12) return std::unexpected(Error::outside_domain);
  return uv;
}

// Eight points in one span of either direction (or beyond its end, if it is the last), from the map's
// tangent plane at `guess`. False where that does not hold: then one goes point by point.
bool PlanMap::invert_eight(const double* x, const double* y, double* u, double* v,
                           const Eigen::Vector2d& guess, Simd simd) const {
  const PlanPoint at_guess = at(guess.x(), guess.y());
  const Eigen::Matrix2d& j = at_guess.jacobian;
  const double det = j(0, 0) * j(1, 1) - j(0, 1) * j(1, 0), spans = static_cast<double>(along_u_.size());
  if (!(std::abs(det) > 1e-12)) return false;
  const auto span_of = [&](double t) {
    return std::clamp(static_cast<int>(t * spans), 0, static_cast<int>(along_u_.size()) - 1);
  };
  const auto near = [](double t) { return t > -near_plate && t < 1 + near_plate; };
  int a = -1, b = -1;
  for (int k = 0; k < 8; ++k) {
    const double dx = x[k] - at_guess.value.x(), dy = y[k] - at_guess.value.y();
    u[k] = guess.x() + (j(1, 1) * dx - j(0, 1) * dy) / det;
    v[k] = guess.y() + (j(0, 0) * dy - j(1, 0) * dx) / det;
    if (!near(u[k]) || !near(v[k])) return false;
    const int span_u = span_of(u[k]), span_v = span_of(v[k]);
    if (k == 0) a = span_u, b = span_v;
    if (span_u != a || span_v != b) return false;
  }
  const PlanSpan span{
      .along_u = along_u_[a].coefficient,
      .along_v = along_v_[b].coefficient,
      .spans = spans,
      .first_u = double(a),
      .first_v = double(b),
      .corner = {{c00_.x(), c00_.y()}, {c10_.x(), c10_.y()}, {c01_.x(), c01_.y()}, {c11_.x(), c11_.y()}},
      .tolerance = batch_tolerance_mm,
      .most_steps = 6};
  if (!plan_map_kernel(simd).invert_eight(span, x, y, u, v)) return false;
  for (int k = 0; k < 8; ++k) {
    const double s = std::clamp(u[k], 0.0, 1.0) * spans, t = std::clamp(v[k], 0.0, 1.0) * spans;
    if (!(s >= a && s <= a + 1 && t >= b && t <= b + 1 && near(u[k]) && near(v[k]))) return false;
  }
  return true;
}

std::size_t PlanMap::invert(std::span<const double> x, std::span<const double> y, std::span<double> u,
                            std::span<double> v, Eigen::Vector2d& guess, double margin, Simd simd) const {
  std::size_t off = 0;
  for (std::size_t first = 0; first < x.size(); first += 8) {
    const std::size_t end = std::min(first + 8, x.size());
    if (end - first == 8 && invert_eight(&x[first], &y[first], &u[first], &v[first], guess, simd)) {
      guess = {u[end - 1], v[end - 1]};
      for (std::size_t k = first; k < end; ++k) {
        if (std::max({-u[k], -v[k], u[k] - 1, v[k] - 1}) <= margin + 1e-12) continue;
        ++off;
        u[k] = v[k] = std::numeric_limits<double>::quiet_NaN();
      }
      continue;
    }
    for (std::size_t k = first; k < end; ++k) {
      const auto uv = invert({x[k], y[k]}, guess, margin);
      if (uv) {
        guess = *uv;
      } else {
        ++off;
      }
      u[k] = uv ? uv->x() : std::numeric_limits<double>::quiet_NaN();
      v[k] = uv ? uv->y() : std::numeric_limits<double>::quiet_NaN();
    }
  }
  return off;
}

void PlanMap::to_net(BSplineSurface& surface) const {
  const int nu = static_cast<int>(surface.knots_u.size()) - cubic - 1;
  const int nv = static_cast<int>(surface.knots_v.size()) - cubic - 1;
  surface.x.resize(nu, nv);
  surface.y.resize(nu, nv);
  const std::vector<double>& knots = outline_.sides[0].knots;
  constexpr std::size_t most_control = 64;
  std::array<double, most_control> coefficients;
  const int side_control = static_cast<int>(outline_.sides[0].control.size());
  assert(side_control <= static_cast<int>(most_control));

  Eigen::MatrixXd* nets[2] = {&surface.x, &surface.y};
  for (int axis = 0; axis < 2; ++axis) {
    Eigen::MatrixXd& net = *nets[axis];
    const auto side_coefficient = [&](int side, bool reversed, std::span<const double> fine, int i) {
      for (int c = 0; c < side_control; ++c)
        coefficients[c] = control(outline_.sides[side], reversed, c)[axis];
      return refined_coefficient(knots, {coefficients.data(), static_cast<std::size_t>(side_control)}, fine,
                                 i);
    };
    // A blend that is linear in one direction has its Greville abscissae as control points: every term of the
    // Coons patch is a product of a spline in one direction and a straight line in the other.
    for (int i = 0; i < nu; ++i) {
      const double low = side_coefficient(0, false, surface.knots_u, i);
      const double high = side_coefficient(2, true, surface.knots_u, i);
      const double g = greville(surface.knots_u, i);
      for (int j = 0; j < nv; ++j) {
        const double h = greville(surface.knots_v, j);
        net(i, j) =
            (1 - h) * low + h * high -
            ((1 - g) * ((1 - h) * c00_[axis] + h * c01_[axis]) + g * ((1 - h) * c10_[axis] + h * c11_[axis]));
      }
    }
    for (int j = 0; j < nv; ++j) {
      const double low = side_coefficient(3, true, surface.knots_v, j);
      const double high = side_coefficient(1, false, surface.knots_v, j);
      for (int i = 0; i < nu; ++i) {
        const double g = greville(surface.knots_u, i);
        net(i, j) += (1 - g) * low + g * high;
      }
    }
  }
}

}  // namespace moldloft::geometry
