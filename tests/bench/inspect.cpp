// A whole inspection: 450,000 single points and the surface of a run against a 23 x 23 design, with alignment from all
// sides, mirrors tried, map, frames and judgement. The limit is one second.
#include "bench/bench_surface.hpp"
#include "bench/benchmark.hpp"
#include "bench/stopwatch.hpp"
#include "firmware_like/inspection/inspection.hpp"

#include <fmt/core.h>

namespace moldloft::bench {

namespace {

using namespace firmware_like;

constexpr double limit_s = 1;

RunResult run_of(const geometry::BSplineSurface& surface) {
  RunResult result;
  result.outcome = Outcome::complete;
  result.measured.emplace();
  result.measured->surface = surface;
  result.measured->outline.rms_mm = 0.05;
  return result;
}

geometry::BSplineSurface moved(geometry::BSplineSurface s, const geometry::RigidMotion& motion) {
  for (int i = 0; i < s.control_u(); ++i) {
    for (int k = 0; k < s.control_v(); ++k) {
      const Eigen::Vector3d p = motion * Eigen::Vector3d{s.x(i, k), s.y(i, k), s.z(i, k)};
      s.x(i, k) = p.x(), s.y(i, k) = p.y(), s.z(i, k) = p.z();
    }
  }
  return s;
}

}  // namespace

Json run_inspect(const Options& options) {
  const auto surface = bench_surface();
  const auto motion = geometry::turned_about_z(0.4, {700, -90, 30});
  const auto run = run_of(moved(surface, motion));
  Design design;
  design.file = "bench";
  design.faces.push_back({surface, {}});
  std::vector<MeasuredPoint> points;
  const int rows = options.quick ? 90 : 900;
  for (const auto& p : scanned_points(surface, rows, 500, 0.025, 2))
    points.push_back({.position = (motion * p).cast<float>(),
                      .residual_mm = 0,
                      .shot = 1,
                      .stripe = 0,
                      .u = 0.5f,
                      .v = 0.5f});
  Json json;
  json["points"] = points.size();
  json["limit_s"] = limit_s;
  for (const auto method : {AlignmentMethod::best, AlignmentMethod::robust}) {
    InspectionSettings settings;
    settings.method = method;
    settings.limit = {-1, 1};
    const auto found = inspect(run, points, design, settings);
    const double seconds =
        time_of(options.quick ? 1 : 5, [&] { keep(inspect(run, points, design, settings)); }).least;
    json["rows"].push_back(
        {{"alignment", to_string(method)}, {"done", found.has_value()}, {"seconds", seconds}});
    if (!options.quiet)
      fmt::print(
          "{} points against {} x {} control points, alignment {}: {:.3f} s, {:.2f} of the limit of {:g} "
          "s{}\n",
          points.size(), surface.control_u(), surface.control_v(), to_string(method), seconds,
          seconds / limit_s, limit_s, found ? "" : " (refused: " + found.error().what + ")");
  }
  return json;
}

}  // namespace moldloft::bench
