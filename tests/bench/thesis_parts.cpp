#include "bench/thesis_parts.hpp"

#include "geometry/splines/derived_curves.hpp"
#include "geometry/stripes/coons_patch.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <string>

namespace moldloft::bench {

using namespace geometry;
using Eigen::Vector2d, Eigen::Vector3d;

void give_up(const std::string& words) {
  fmt::print(stderr, "moldloft-bench thesis: {}\n", words);
  std::exit(1);
}

Line within_square(const Vector2d& through, const Vector2d& direction) {
  double first = -1e9, last = 1e9;
  for (int axis = 0; axis < 2; ++axis) {
    if (direction[axis] == 0) continue;
    const double a = -through[axis] / direction[axis], b = (1 - through[axis]) / direction[axis];
    first = std::max(first, std::min(a, b)), last = std::min(last, std::max(a, b));
  }
  const auto at = [&](double s) { return Vector2d((through + s * direction).cwiseMax(0).cwiseMin(1)); };
  return {at(first), at(last)};
}

SampledStripe sample_stripe(const BSplineSurface& surface, const Line& line, int count) {
  SampledStripe stripe;
  for (int i = 0; i < count; ++i) {
    const double t = i / (count - 1.0);
    stripe.uv.push_back((1 - t) * line.from + t * line.to);
    stripe.points.push_back(surface.at(stripe.uv.back().x(), stripe.uv.back().y()).value);
  }
  return stripe;
}

Spread spread_of(std::span<const double> values) {
  Spread spread{0, 0, 0, values.empty() ? 0 : values[0]};
  for (const double value : values) {
    spread.average += value / static_cast<double>(values.size());
    spread.max = std::max(spread.max, value), spread.min = std::min(spread.min, value);
  }
  double squares = 0;
  for (const double value : values) squares += (value - spread.average) * (value - spread.average);
  spread.deviation = std::sqrt(squares / static_cast<double>(values.size()));
  return spread;
}

Json to_json(const Spread& spread) {
  return {{"avg", spread.average}, {"std", spread.deviation}, {"max", spread.max}, {"min", spread.min}};
}

double foot_distance(const BSplineSurface& surface, const Vector3d& point, Vector2d uv) {
  const auto clamped = [](const Vector2d& p) { return Vector2d(p.cwiseMax(0).cwiseMin(1)); };
  uv = clamped(uv);
  double best = (surface.at(uv.x(), uv.y()).value - point).norm();
  for (int step = 0; step < 30; ++step) {
    const SurfacePoint s = surface.at(uv.x(), uv.y());
    const Vector3d d = s.value - point;
    const Vector2d gradient(d.dot(s.du), d.dot(s.dv));
    Eigen::Matrix2d hessian;
    hessian << s.du.dot(s.du) + d.dot(s.duu), s.du.dot(s.dv) + d.dot(s.duv), 0, s.dv.dot(s.dv) + d.dot(s.dvv);
    hessian(1, 0) = hessian(0, 1);
    if (!(hessian(0, 0) > 0) || !(hessian.determinant() > 0))
      hessian << s.du.dot(s.du), s.du.dot(s.dv), s.du.dot(s.dv), s.dv.dot(s.dv);
    Vector2d move = -hessian.inverse() * gradient;
    double next = best;
    Vector2d there = uv;
    for (int half = 0; half < 30 && !(next < best); ++half, move *= 0.5) {
      there = clamped(uv + move);
      next = (surface.at(there.x(), there.y()).value - point).norm();
    }
    if (!(next < best)) break;
    best = next, uv = there;
  }
  return best;
}

Comparison compare(const BSplineSurface& ours, const BSplineSurface& truth) {
  constexpr int grid = 50;
  std::vector<double> height, distance;
  for (int i = 0; i < grid; ++i) {
    for (int j = 0; j < grid; ++j) {
      const double u = i / (grid - 1.0), v = j / (grid - 1.0);
      const Vector3d point = ours.at(u, v).value;
      height.push_back(std::abs((point - truth.at(u, v).value).z()));
      distance.push_back(foot_distance(truth, point, {u, v}));
    }
  }
  return {spread_of(height), spread_of(distance)};
}

BSplineSurface graph_surface(const std::vector<double>& knots_u, const std::vector<double>& knots_v,
                             double size, const std::function<double(int, int)>& height) {
  BSplineSurface surface{knots_u, knots_v, {}, {}, {}};
  const int nu = static_cast<int>(knots_u.size()) - 4, nv = static_cast<int>(knots_v.size()) - 4;
  surface.x.resize(nu, nv), surface.y.resize(nu, nv), surface.z.resize(nu, nv);
  for (int i = 0; i < nu; ++i) {
    for (int j = 0; j < nv; ++j) {
      surface.x(i, j) = size * greville(knots_u, i);
      surface.y(i, j) = size * greville(knots_v, j);
      surface.z(i, j) = height(i, j);
    }
  }
  return surface;
}

BSplineSurface coons_base(const BSplineSurface& surface) {
  const auto patch = CoonsPatch::through({line_along_u(surface, 0), line_along_u(surface, 1),
                                          line_along_v(surface, 0), line_along_v(surface, 1)});
  if (!patch) give_up(std::string{to_string(patch.error().error)});
  return patch->net();
}

namespace {

StripeFit solved(const std::expected<BSplineSurfaceFit, MatchingFailure>& fit,
                 std::span<const SpaceCurve> curves, std::span<const SampledPoints> points,
                 const BSplineSurface& base) {
  if (!fit) give_up(describe(fit.error()));
  auto surface = fit->solve(curves, points, base);
  if (!surface) give_up(describe(surface.error()));
  return {std::move(*surface), fit->report(), fit->condition()};
}

}  // namespace

StripeFit fit_stripes(std::span<const SampledStripe> stripes, const std::vector<double>& knots,
                      const BSplineSurface& base, StripeParameter parameter, PieceWeight weight) {
  std::vector<StripeTrack> tracks;
  std::vector<SpaceCurve> curves;
  for (const SampledStripe& stripe : stripes) {
    auto curve = fit_stripe(stripe.points, stripe.uv, knots, parameter);
    if (!curve) give_up(std::string{to_string(curve.error().error)});
    tracks.push_back(std::move(curve->track)), curves.push_back(std::move(curve->curve));
  }
  const auto fit = BSplineSurfaceFit::assemble(base.knots_u, base.knots_v, tracks, {}, {.weight = weight});
  return solved(fit, curves, {}, base);
}

StripeFit fit_points(std::span<const SampledStripe> stripes, const BSplineSurface& base) {
  std::vector<SampledTrack> tracks;
  std::vector<SampledPoints> points;
  for (const SampledStripe& stripe : stripes) {
    tracks.push_back({stripe.uv, {}});
    points.push_back(stripe.points);
  }
  return solved(BSplineSurfaceFit::assemble(base.knots_u, base.knots_v, {}, tracks), {}, points, base);
}

}  // namespace moldloft::bench
