// moldloft-bench curvature: what it costs to look at a surface (curvature map, contours, isophotes) and to
// fit one whose parameters are not known (parameter correction).
#include "geometry/inspection/curvature.hpp"

#include "bench/benchmark.hpp"
#include "bench/stopwatch.hpp"
#include "geometry/inspection/isolines.hpp"
#include "geometry/stripes/parameter_correction.hpp"

#include <fmt/core.h>

#include <cmath>
#include <numbers>

namespace moldloft::bench {

namespace {

using namespace geometry;

// A plate of 305 mm with waves of 20 mm, 23 x 23 control points.
BSplineSurface plate() {
  BSplineSurface s{uniform_clamped_knots(20), uniform_clamped_knots(20), {}, {}, {}};
  s.x.resize(23, 23), s.y.resize(23, 23), s.z.resize(23, 23);
  for (int i = 0; i < 23; ++i) {
    for (int j = 0; j < 23; ++j) {
      s.x(i, j) = 305 * greville(s.knots_u, i), s.y(i, j) = 305 * greville(s.knots_v, j);
      s.z(i, j) = 20 * std::sin(s.x(i, j) / 60) * std::cos(s.y(i, j) / 70);
    }
  }
  return s;
}

// The egg crate of the thesis's size (11 x 11), under 16 stripes of 81 points whose parameters are guessed
// by chord length.
struct Wave {
  BSplineSurface truth{uniform_clamped_knots(8), uniform_clamped_knots(8), {}, {}, {}};
  std::vector<Eigen::Vector3d> points;
  std::vector<Eigen::Vector2d> parameters;
  Wave() {
    truth.x.resize(11, 11), truth.y.resize(11, 11), truth.z.setZero(11, 11);
    constexpr double turn = 4 * std::numbers::pi;
    for (int i = 0; i < 11; ++i) {
      for (int j = 0; j < 11; ++j) {
        const double g = truth.x(i, j) = greville(truth.knots_u, i),
                     h = truth.y(i, j) = greville(truth.knots_v, j);
        if (i > 0 && j > 0 && i < 10 && j < 10) truth.z(i, j) = 0.3 * std::sin(turn * g) * std::sin(turn * h);
      }
    }
    for (int s = 0; s < 16; ++s) {
      std::vector<Eigen::Vector3d> stripe;
      for (int k = 0; k <= 80; ++k) stripe.push_back(truth.at((s + 0.5) / 16, k / 80.0).value);
      const auto start = chord_length_parameters(stripe, {(s + 0.5) / 16, 0}, {(s + 0.5) / 16, 1});
      points.insert(points.end(), stripe.begin(), stripe.end());
      parameters.insert(parameters.end(), start.begin(), start.end());
    }
  }
};

Json correction(const Wave& wave, CorrectionStep step, int rounds, int repeats) {
  const CorrectionSettings settings{
      .step = step, .most_rounds = rounds, .enough_mm = 1e-13, .keep_border = true};
  CorrectionReport report;
  const Seconds time = time_of(repeats, [&] {
    report = fit_with_parameter_correction(wave.points, wave.parameters, wave.truth, settings).value().report;
  });
  const int taken = report.accepted + report.rejected;
  return {{"rounds", taken},
          {"ms_a_round", time.median * 1e3 / taken},
          {"start_rms", report.start_rms_mm},
          {"rms", report.rms_mm},
          {"end", std::string(to_string(report.end))}};
}

void print(const Json& result) {
  const auto row = [&](std::string_view what, const char* key, std::string_view unit) {
    fmt::print("{:<52}{:>10.1f} {}\n", what, result[key].get<double>(), unit);
  };
  fmt::print("Plate of 23 x 23 control points\n\n");
  row("floor: value and all derivatives at a point", "evaluate_ns", "ns");
  row("curvature at a point, with directions", "curvature_at_ns", "ns");
  row("curvature map, evaluation included", "map_ns", "ns a node");
  row("contour from a grid of heights", "trace_ns", "ns a node");
  row("contour refined on the surface", "refine_us", "us a vertex");
  fmt::print("\nEgg crate, 1,296 points, 11 x 11, from chord-length parameters\n\n");
  fmt::print("{:<28}{:>8}{:>14}{:>12}{:>12}   {}\n", "", "rounds", "ms a round", "start rms", "rms", "end");
  for (const auto& [name, run] : result["correction"].items()) {
    fmt::print("{:<28}{:>8}{:>14.2f}{:>12.1e}{:>12.1e}   {}\n", name, run["rounds"].get<int>(),
               run["ms_a_round"].get<double>(), run["start_rms"].get<double>(), run["rms"].get<double>(),
               run["end"].get<std::string>());
  }
}

}  // namespace

Json run_curvature(const Options& options) {
  const int repeats = options.quick ? 3 : 15, side = options.quick ? 100 : 500;
  const BSplineSurface surface = plate();
  const std::vector<double> steps = even_steps(side);
  const double nodes = static_cast<double>(side) * side;
  const auto ns = [&](double count, auto&& work) { return time_of(repeats, work).median * 1e9 / count; };

  Json result;
  double sum = 0;
  result["evaluate_ns"] = ns(nodes, [&] {
    for (const double u : steps) {
      for (const double v : steps) sum += surface.at(u, v).dvv.z();
    }
    keep(sum);
  });
  result["curvature_at_ns"] = ns(nodes, [&] {
    const SurfacePoint point = surface.at(0.3, 0.4);
    SurfacePoint moving = point;
    for (int k = 0; k < side * side; ++k) {
      moving.dvv.z() = point.dvv.z() + k;
      sum += curvature_at(moving)->k1;
    }
    keep(sum);
  });
  std::vector<CurvatureSample> map(steps.size() * steps.size());
  result["map_ns"] = ns(nodes, [&] { keep(curvature_map(surface, steps, steps, map).value()); });

  const HeightOn height{surface};
  const ScalarGrid grid = sample_field(height, steps, steps);
  Isolines lines;
  result["trace_ns"] = ns(nodes, [&] { lines = trace_isolines(grid, 7.0).value(); });
  Isolines refined;
  result["refine_us"] = ns(static_cast<double>(lines.vertices.size()),
                           [&] {
                             refined = lines;
                             refine_isolines(refined, height, 7.0);
                           }) /
                        1e3;
  const Wave wave;
  result["correction"] = {
      {"tangent-distance steps", correction(wave, CorrectionStep::tangent_distance, 30, repeats)},
      {"point-distance steps", correction(wave, CorrectionStep::point_distance, 100, repeats)}};
  if (!options.quiet) print(result);
  return result;
}

}  // namespace moldloft::bench
