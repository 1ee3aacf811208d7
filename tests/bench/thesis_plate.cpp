// Section 6.4, the plate: nine shots, 54 stripes as cubic Bezier curves, boundary curves of 8 control points,
// 25 patches, and 1,169 points of a coordinate measuring machine to compare with.
#include "bench/thesis.hpp"
#include "bench/thesis_simulated_plate.hpp"
#include "geometry/fit/plan_map.hpp"
#include "geometry/stripes/coons_patch.hpp"

#include <fmt/core.h>

#include <array>
#include <cmath>
#include <random>
#include <string>

namespace moldloft::bench {

using namespace geometry;
using Eigen::Vector2d, Eigen::Vector3d;

namespace {

constexpr int spans = 5;
constexpr int stripe_count = 54, stripe_points = 500;
constexpr double edge_noise_mm = 0.2;  // of an edge point along its stripe: the spacing of points on it
constexpr double published_max_mm = 1.49;

// The Coons patch of four boundary curves through noisy edge points. Ends are the points seen there: at a
// corner two of them, between which the patch settles.
BSplineSurface measured_base(std::mt19937& random) {
  std::normal_distribution<double> normal(0, 1);
  const auto knots = uniform_clamped_knots(spans);
  const std::array<Line, 4> sides{Line{{0, 0}, {1, 0}}, Line{{0, 1}, {1, 1}}, Line{{0, 0}, {0, 1}},
                                  Line{{1, 0}, {1, 1}}};
  std::array<SpaceCurve, 4> curves;
  constexpr int count = 300;
  for (int side = 0; side < 4; ++side) {
    std::vector<Vector3d> points;
    for (int i = 0; i < count; ++i) {
      const double t = i / (count - 1.0);
      Vector2d xy = plate_size_mm * ((1 - t) * sides[side].from + t * sides[side].to);
      const double z = plate_height(xy.x(), xy.y()) + height_noise_mm * normal(random);
      const bool corner = i == 0 || i == count - 1;
      if (!corner) xy[side < 2 ? 1 : 0] += edge_noise_mm * normal(random);
      points.emplace_back(xy.x(), xy.y(), z);
    }
    const auto curve = fit_curve<3>(points, knots, {.interpolate_ends = true});
    if (!curve) give_up(std::string{to_string(curve.error().error)});
    curves[side] = curve->curve;
  }
  const auto patch = CoonsPatch::through({curves[0], curves[1], curves[2], curves[3]}, 10 * height_noise_mm);
  if (!patch) give_up(std::string{to_string(patch.error().error)});
  return patch->net();
}

// (u, v) of what the robot believes, by inverting the boundary's planar Coons map.
bool place_in_plan(std::vector<SampledStripe>& stripes, const BSplineSurface& base) {
  Outline outline;
  const auto point = [&](int i, int j) { return Vector2d(base.x(i, j), base.y(i, j)); };
  constexpr int last = spans + 2;
  outline.corners = {point(0, 0), point(last, 0), point(last, last), point(0, last)};
  for (PlanCurve& side : outline.sides) side.knots = base.knots_u;
  for (int i = 0; i <= last; ++i) {
    outline.sides[0].control.push_back(point(i, 0)), outline.sides[1].control.push_back(point(last, i));
    outline.sides[2].control.push_back(point(last - i, last)),
        outline.sides[3].control.push_back(point(0, last - i));
  }
  const PlanMap map(outline);
  if (!map.check()) return false;
  for (SampledStripe& stripe : stripes) {
    for (std::size_t i = 0; i < stripe.points.size(); ++i) {
      const auto uv = map.invert(stripe.points[i].head<2>(), stripe.uv[i], 0.05);
      if (!uv) return false;
      stripe.uv[i] = uv->cwiseMax(0).cwiseMin(1);
    }
  }
  return true;
}

Spread distances_of_cmm_points(const BSplineSurface& surface) {
  std::mt19937 random(1169);
  std::uniform_real_distribution<double> inside(2 / plate_size_mm, 1 - 2 / plate_size_mm);
  std::normal_distribution<double> normal(0, 0.005);
  std::vector<double> distances;
  for (int i = 0; i < 1169; ++i) {
    const Vector2d at(inside(random), inside(random)), xy = plate_size_mm * at;
    distances.push_back(
        foot_distance(surface, {xy.x(), xy.y(), plate_height(xy.x(), xy.y()) + normal(random)}, at));
  }
  return spread_of(distances);
}

}  // namespace

Json thesis_plate(const Options& options) {
  std::mt19937 random(64);
  const BSplineSurface base = measured_base(random);
  auto stripes = plate_stripes(stripe_count, stripe_points, {height_noise_mm, robot_error_mm}, 54);
  if (!place_in_plan(stripes, base)) return nullptr;

  const auto bezier = uniform_clamped_knots(1);
  const StripeFit chord = fit_stripes(stripes, bezier, base, StripeParameter::chord_length, PieceWeight::one);
  const StripeFit consistent =
      fit_stripes(stripes, bezier, base, StripeParameter::consistent, PieceWeight::length);
  const StripeFit plan = fit_points(stripes, base);
  const Spread of_base = distances_of_cmm_points(base), of_chord = distances_of_cmm_points(chord.surface),
               of_consistent = distances_of_cmm_points(consistent.surface),
               of_plan = distances_of_cmm_points(plan.surface);
  Json json{
      {"simulated", true},
      {"published", {{"max_mm", published_max_mm}, {"stripes", 54}, {"patches", 25}, {"cmm_points", 1169}}},
      {"ours",
       {{"stripes", stripes.size()},
        {"pieces", chord.report.pieces},
        {"coons_base_mm", to_json(of_base)},
        {"thesis_chain_mm", to_json(of_chord)},
        {"consistent_by_length_mm", to_json(of_consistent)},
        {"plan_view_points_mm", to_json(of_plan)}}}};
  if (options.quiet) return json;
  fmt::print(
      "\n6.4 Plate, simulated: {} mm, nine shots, {} stripes as cubic Bezier curves ({} pieces), 8 x 8 "
      "control points\n",
      plate_size_mm, stripes.size(), chord.report.pieces);
  fmt::print(
      "  noise: height {} mm, robot {} mm a shot, edge points {} mm; 1,169 CMM points (0.005 mm), no "
      "localization\n",
      height_noise_mm, robot_error_mm, edge_noise_mm);
  fmt::print(
      "  distance of the CMM points, mm, avg / max: thesis (real plate) max {}; base {:.3f} / {:.3f}; chord "
      "length {:.3f} / {:.3f}; "
      "consistent, by length {:.3f} / {:.3f}; plan view points {:.3f} / {:.3f}\n",
      published_max_mm, of_base.average, of_base.max, of_chord.average, of_chord.max, of_consistent.average,
      of_consistent.max, of_plan.average, of_plan.max);
  return json;
}

}  // namespace moldloft::bench
