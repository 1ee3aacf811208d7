// Section 6.2.1, the wave-like surface: how the stripes are parametrized decides, not the algebra.
#include "bench/thesis.hpp"
#include "bench/thesis_parts.hpp"
#include "geometry/fit/plan_map.hpp"
#include "geometry/stripes/parameter_correction.hpp"

#include <fmt/core.h>

#include <cmath>
#include <numbers>
#include <string>

namespace moldloft::bench {

using namespace geometry;
using Eigen::Vector2d;

namespace {

constexpr double peak = 0.1333;   // of the thesis's surface, and the depth of its troughs
constexpr int spans = 8;          // 11 x 11 control points
constexpr int stripe_spans = 17;  // 20 control points a stripe
constexpr int stripe_points = 81;
constexpr int correction_rounds = 30;

struct NamedSurface {
  std::string name;
  BSplineSurface surface;
  bool smooth = true;  // twenty control points a stripe follow it to 1e-6
};

// The thesis prints knots and peak, not the control net: four waves that fit what it does print.
std::vector<NamedSurface> waves() {
  const auto knots = uniform_clamped_knots(spans);
  const auto place = [&](int i) { return greville(knots, i); };
  std::vector<NamedSurface> all;
  all.push_back({"egg crate, flat border", graph_surface(knots, knots, 1, [&](int i, int j) {
                   return std::sin(2 * std::numbers::pi * place(i)) *
                          std::sin(2 * std::numbers::pi * place(j));
                 })});
  // Single control points of height 0.3 peak at 4/9 of it, 0.1333: nine of them, up and down by turns.
  all.push_back({"nine control points",
                 graph_surface(knots, knots, 1,
                               [](int i, int j) {
                                 const bool inside = i >= 3 && i <= 7 && j >= 3 && j <= 7;
                                 if (!inside || i % 2 == 0 || j % 2 == 0) return 0.0;
                                 return ((i + j) / 2) % 2 == 1 ? 0.3 : -0.3;
                               }),
                 false});
  all.push_back({"diagonal, wavy border", graph_surface(knots, knots, 1, [&](int i, int j) {
                   return std::sin(2 * std::numbers::pi * (place(i) + place(j)));
                 })});
  // Control points at equal distances: x(u) and y(v) are not straight.
  all.push_back(
      {"strong, x(u), y(v) uneven",
       graph_surface(knots, knots, 1,
                     [](int i, int j) { return ((i / 2 + j / 2) % 2 == 0 ? 1.0 : -1.0) * (0.6 + 0.04 * i); }),
       false});
  for (int i = 0; i < spans + 3; ++i) {
    all.back().surface.x.row(i).setConstant(i / (spans + 2.0));
    all.back().surface.y.col(i).setConstant(i / (spans + 2.0));
  }
  for (auto& [name, surface, smooth] : all) {
    double highest = 0;
    for (double u = 0; u <= 1; u += 1.0 / 256)
      for (double v = 0; v <= 1; v += 1.0 / 256)
        highest = std::max(highest, std::abs(surface.at(u, v).value.z()));
    surface.z *= peak / highest;
  }
  return all;
}

struct Layout {
  std::string name;
  std::vector<Line> lines;
};

std::vector<Layout> layouts() {
  std::vector<Layout> all{{"slanted", {}}, {"parallel", {}}, {"oblique, 25 degrees", {}}, {"crossed", {}}};
  for (int s = 0; s < 16; ++s) {
    const double share = (s + 0.5) / 16;
    // 426 pieces, the thesis's number, need more slant than leaves any parallel stripe in two of the corners.
    all[0].lines.push_back(within_square({share - 0.1, 0}, {0.2, 1}));
    all[1].lines.push_back({{share, 0}, {share, 1}});
    const double slope = 25 * std::numbers::pi / 180, reach = std::sin(slope) + std::cos(slope);
    const Vector2d along(std::sin(slope), std::cos(slope)), across(std::cos(slope), -std::sin(slope));
    all[2].lines.push_back(within_square(Vector2d(0.5, 0.5) + (share - 0.5) * reach * across, along));
    const double tilt = s < 8 ? 0.15 : -0.15, place = (s % 8 + 0.5) / 8;
    all[3].lines.push_back(s < 8 ? Line{{place * 0.85, 0}, {place * 0.85 + tilt, 1}}
                                 : Line{{0, place * 0.85 - tilt}, {1, place * 0.85}});
  }
  return all;
}

// (u, v) of the points by inverting the boundary's planar Coons map at their (x, y), which need not be known
// otherwise. The map's accuracy is stated in mm: the unit square is taken as a metre.
constexpr double unit_mm = 1000;
std::vector<SampledStripe> in_plan_view(std::span<const SampledStripe> stripes, const PlanMap& map) {
  std::vector<SampledStripe> all(stripes.begin(), stripes.end());
  for (SampledStripe& stripe : all) {
    Vector2d guess(0.5, 0.5);
    for (std::size_t i = 0; i < stripe.points.size(); ++i) {
      const auto uv = map.invert(unit_mm * stripe.points[i].head<2>(), guess, 1e-9);
      guess = uv.value_or(guess);
      stripe.uv[i] = guess.cwiseMax(0).cwiseMin(1);
    }
  }
  return all;
}

Outline outline_of(const BSplineSurface& surface) {
  Outline outline;
  const auto point = [&](Eigen::Index i, Eigen::Index j) {
    return Vector2d(unit_mm * surface.x(i, j), unit_mm * surface.y(i, j));
  };
  const Eigen::Index m = surface.x.rows() - 1, n = surface.x.cols() - 1;
  outline.corners = {point(0, 0), point(m, 0), point(m, n), point(0, n)};
  for (PlanCurve& side : outline.sides) side.knots = surface.knots_u;
  for (Eigen::Index i = 0; i <= m; ++i) {
    outline.sides[0].control.push_back(point(i, 0));
    outline.sides[1].control.push_back(point(m, i));
    outline.sides[2].control.push_back(point(m - i, n));
    outline.sides[3].control.push_back(point(0, n - i));
  }
  return outline;
}

// From the thesis's own start, straight pre-images and chord lengths, the parameters are
// corrected together with the surface by tangent-distance steps.
BSplineSurface corrected(std::span<const SampledStripe> stripes, const BSplineSurface& base) {
  std::vector<Eigen::Vector3d> points;
  std::vector<Vector2d> parameters;
  for (const SampledStripe& stripe : stripes) {
    points.insert(points.end(), stripe.points.begin(), stripe.points.end());
    const auto start = chord_length_parameters(stripe.points, stripe.uv.front(), stripe.uv.back());
    parameters.insert(parameters.end(), start.begin(), start.end());
  }
  const auto fit = fit_with_parameter_correction(
      points, parameters, base, {.most_rounds = correction_rounds, .enough_mm = 1e-13, .keep_border = true});
  return fit ? fit->surface : base;
}

}  // namespace

Json thesis_wave(const Options& options) {
  const Spread published{0.00127, 0.00111, 0.00514, 0.0};
  Json result{{"published", to_json(published)}, {"published_pieces", 426}};
  if (!options.quiet) {
    fmt::print(
        "\n6.2.1 Wave: 11 x 11 control points, +-{}, 16 stripes of {} points and 20 control points, boundary "
        "given\n",
        peak, stripe_points);
    fmt::print(
        "Height error at equal (u, v) on 50 x 50 points, avg / std / max; the thesis: {:.5f} / {:.5f} / "
        "{:.5f}, 426 pieces\n",
        published.average, published.deviation, published.max);
    fmt::print("{:26} {:20} {:>6} {:>6}  {:32} {:>8}  {:19} {:23} {:23} {:>9} {:>9}\n",
               "wave (ours: net not printed)", "stripes", "pieces", "cond", "chord length (the thesis)",
               "distance", "corrected, 30 steps", "consistent t, literal", "the same, by length", "points",
               "plan view");
  }
  double smooth_average = 0, strong_average = 0, plan_max = 0, points_max = 0;
  const auto all_waves = waves();
  auto all_layouts = layouts();
  if (options.quick) all_layouts.resize(2);
  for (const auto& [wave, truth, smooth] : all_waves) {
    const BSplineSurface base = coons_base(truth);
    const PlanMap map(outline_of(truth));
    for (const auto& [layout, lines] : all_layouts) {
      std::vector<SampledStripe> stripes;
      for (const Line& line : lines) stripes.push_back(sample_stripe(truth, line, stripe_points));
      const auto knots = uniform_clamped_knots(stripe_spans);
      const auto chord = fit_stripes(stripes, knots, base, StripeParameter::chord_length, PieceWeight::one);
      const auto consistent =
          fit_stripes(stripes, knots, base, StripeParameter::consistent, PieceWeight::one);
      const auto weighted =
          fit_stripes(stripes, knots, base, StripeParameter::consistent, PieceWeight::length);
      const Comparison of_corrected = compare(corrected(stripes, base), truth);
      const auto points = fit_points(stripes, base);
      BSplineSurface plan_base = base;
      map.to_net(plan_base);
      plan_base.x /= unit_mm, plan_base.y /= unit_mm;
      const auto plan = fit_points(in_plan_view(stripes, map), plan_base);

      const Comparison of_chord = compare(chord.surface, truth),
                       of_consistent = compare(consistent.surface, truth),
                       of_weighted = compare(weighted.surface, truth),
                       of_points = compare(points.surface, truth), of_plan = compare(plan.surface, truth),
                       of_base = compare(base, truth);
      double& literal_average = smooth ? smooth_average : strong_average;
      literal_average = std::max(literal_average, of_consistent.height.average);
      plan_max = std::max(plan_max, of_plan.height.max);
      points_max = std::max(points_max, of_points.height.max);
      result["cases"].push_back({{"wave", wave},
                                 {"stripes", layout},
                                 {"pieces", chord.report.pieces},
                                 {"condition", std::sqrt(consistent.condition)},
                                 {"coons_base", to_json(of_base.height)},
                                 {"chord_length", to_json(of_chord.height)},
                                 {"chord_length_distance", to_json(of_chord.distance)},
                                 {"corrected", to_json(of_corrected.height)},
                                 {"corrected_distance", to_json(of_corrected.distance)},
                                 {"consistent", to_json(of_consistent.height)},
                                 {"consistent_by_length", to_json(of_weighted.height)},
                                 {"exact_points", to_json(of_points.height)},
                                 {"plan_view", to_json(of_plan.height)}});
      if (options.quiet) continue;
      const auto three = [](const Spread& s) {
        return fmt::format("{:.1e} / {:.1e} / {:.1e}", s.average, s.deviation, s.max);
      };
      const auto two = [](const Spread& s) { return fmt::format("{:.1e} / {:.1e}", s.average, s.max); };
      fmt::print("{:26} {:20} {:6} {:6.0f}  {:32} {:8.1e}  {:19} {:23} {:23} {:9.1e} {:9.1e}\n", wave, layout,
                 chord.report.pieces, std::sqrt(consistent.condition), three(of_chord.height),
                 of_chord.distance.average, two(of_corrected.height), two(of_consistent.height),
                 two(of_weighted.height), of_points.height.max, of_plan.height.max);
    }
  }
  result["literal_consistent_avg"] = smooth_average;
  result["literal_consistent_avg_strong"] = strong_average;
  result["plan_view_max"] = plan_max;
  result["exact_points_max"] = points_max;
  if (!options.quiet)
    fmt::print(
        "Largest: literal system with consistent t {:.1e} average (smooth waves), {:.1e} (the two strong "
        "ones); plan view {:.1e} at most.\n",
        smooth_average, strong_average, plan_max);
  return result;
}

}  // namespace moldloft::bench
