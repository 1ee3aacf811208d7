// moldloft-bench edges: the plate's edge in one shot. Ours (runs, boundary, line) beside the floor: reading
// the frame, and the largest second difference of every stripe, the least that an edge detector can do.
#include "bench/benchmark.hpp"
#include "bench/stopwatch.hpp"
#include "geometry/edges/boundary_view.hpp"
#include "geometry/edges/edge_lines.hpp"
#include "geometry/edges/plate_runs.hpp"
#include "geometry/edges/range_image.hpp"
#include "geometry/edges/stripe_scene.hpp"
#include "geometry/fit/plan_map.hpp"
#include "geometry/outline_shapes.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <random>
#include <vector>

namespace moldloft::bench {

namespace {

using namespace geometry;
using Eigen::Vector2d;

constexpr double edge_at = 10.0,
                 edge_slope = 0.1;  // y of the edge = edge_at + edge_slope x: 5.7 degrees oblique

// 100 stripes of 500 points, a drop of 6 mm beyond the edge.
test::StripeScene shot(unsigned seed, bool clean) {
  test::StripeScene scene;
  const auto edge = [](double x) { return edge_at + edge_slope * x; };
  scene.outline = {{-300, -300}, {300, -300}, {300, edge(300)}, {-300, edge(-300)}};
  scene.thickness = 5.5;  // the scene's table lies half a millimetre lower
  scene.noise = clean ? 0.025 : 0.051;
  if (clean) scene.outliers = scene.drop_outs = 0;
  if (!clean) scene.outliers = 0.01, scene.drop_outs = 0.03, scene.wall_points = 2;
  scene.seed = seed;
  scene.y_phase = 0.013 * seed;
  return scene;
}

struct LineError {
  double position_mm = 0, slope = 0;  // at the field's middle; against the true slope
};

LineError error_of(const EdgeLine& line) {
  // Where the line crosses x = 0, measured across the true edge.
  const double slope = line.direction.y() / line.direction.x();
  const double at = line.centre.y() - slope * line.centre.x();
  return {std::abs(at - edge_at) / std::hypot(1.0, edge_slope), std::abs(slope - edge_slope)};
}

// The floor of every method: each number once.
float read(std::span<const StripeView> stripes) {
  std::array<float, 16> sum{};
  for (const StripeView& stripe : stripes) {
    for (const auto column : {stripe.x, stripe.y, stripe.z}) {
      for (std::size_t i = 0; i + 16 <= column.size(); i += 16) {
        for (std::size_t k = 0; k < 16; ++k) sum[k] += column[i + k];
      }
    }
  }
  float all = 0;
  for (const float s : sum) all += s;
  return all;
}

// The point of the largest second difference: blocks first, then the place within the best. NaN never wins.
std::size_t largest_second_difference(std::span<const float> z) {
  constexpr std::size_t lanes = 16;
  const auto at = [&](std::size_t i) { return std::abs(z[i - 1] - 2 * z[i] + z[i + 1]); };
  float most = 0;
  std::size_t block = 1, i = 1;
  for (; i + lanes < z.size(); i += lanes) {
    float largest = 0;
    for (std::size_t k = 0; k < lanes; ++k) {
      const float d = at(i + k);
      largest = d > largest ? d : largest;
    }
    if (largest > most) most = largest, block = i;
  }
  std::size_t best = block;
  for (std::size_t k = block; k < std::min(block + lanes, z.size() - 1); ++k) {
    if (at(k) > at(best)) best = k;
  }
  for (; i + 1 < z.size(); ++i) {
    if (at(i) > most) most = at(i), best = i;
  }
  return best;
}

void edges_by_second_difference(std::span<const StripeView> stripes, std::vector<EdgePoint>& edge) {
  edge.clear();
  for (std::uint16_t s = 0; s < stripes.size(); ++s) {
    const StripeView& stripe = stripes[s];
    const std::size_t i = largest_second_difference(stripe.z);
    // The drop lies beside that point: between it and the neighbour that differs more.
    const bool after = std::abs(stripe.z[i + 1] - stripe.z[i]) > std::abs(stripe.z[i] - stripe.z[i - 1]);
    const std::size_t a = after ? i : i - 1;
    const Eigen::Vector3d at(stripe.x[i], 0.5 * (stripe.y[a] + stripe.y[a + 1]), stripe.z[a]);
    if (at.allFinite()) edge.push_back({at, s});
  }
}

// A frame's whole way: find(), look(), a line through the longest piece.
struct Ours {
  PlateRunFinder finder{100, 50'000};
  BoundaryViewer viewer{4000};
  std::optional<EdgeLine> operator()(std::span<const StripeView> stripes) {
    const auto runs = finder.find(stripes, {0, -20, 0}, {});
    if (!runs) return std::nullopt;
    const auto view = viewer.look(*runs, stripes.size(), {});
    if (view.pieces.empty()) return std::nullopt;
    return fit_edge_line(view.points.subspan(view.pieces[0].first, view.pieces[0].count));
  }
};

// Root mean square over several frames.
template <typename Method>
Json errors(bool clean, int frames, Method&& method) {
  double position = 0, slope = 0;
  int found = 0;
  for (int seed = 1; seed <= frames; ++seed) {
    const test::Frame frame = sample(shot(static_cast<unsigned>(seed), clean));
    const std::optional<EdgeLine> line = method(frame.views);
    if (!line) continue;
    const LineError error = error_of(*line);
    position += error.position_mm * error.position_mm, slope += error.slope * error.slope, ++found;
  }
  return {{"line_error_mm", std::sqrt(position / found)},
          {"angle_error_deg", std::sqrt(slope / found) * 180 / std::numbers::pi},
          {"found", found},
          {"frames", frames}};
}

Json range_image(const std::string& name, int first, int end, const Eigen::Vector3d& hint_px, int datum,
                 int repeats) {
  const test::RangeImage image = test::load_range_image(name);
  if (image.width == 0) return nullptr;
  const test::Stripes stripes = test::stripes_of(image, first, end, datum);
  const auto points = static_cast<std::size_t>(end - first) * static_cast<std::size_t>(image.width);
  PlateRunFinder finder(stripes.views.size(), points);
  PlateRunSettings settings;
  settings.field_half_y_mm = 1000;
  const Eigen::Vector3d hint(hint_px.x() * image.stripe_mm, hint_px.y() * image.point_mm, 0);
  std::size_t runs = 0;
  const Seconds time = time_of(repeats, [&] {
    const auto found = finder.find(stripes.views, hint, settings);
    runs = found ? found->size() : 0;
  });
  return {{"points", points}, {"runs", runs}, {"find_ns", time.median * 1e9 / static_cast<double>(points)}};
}

// A point beside the last, over a bent outline.
double plan_map_inverse_ns(int repeats) {
  const PlanMap map(test::bent_outline());
  std::vector<Vector2d> points;
  for (int i = 0; i < 5000; ++i) points.push_back({60 + 0.02 * i, 100 + 0.01 * i});
  double sum = 0;
  const Seconds time = time_of(repeats, [&] {
    Vector2d uv(0.5, 0.5);
    for (const Vector2d& p : points) {
      uv = map.invert(p, uv).value_or(uv);
      sum += uv.x();
    }
  });
  keep(sum);
  return time.median * 1e9 / static_cast<double>(points.size());
}

void print(const Json& result) {
  fmt::print("One shot: 100 stripes of 500 points, 6 mm drop at y = 10 + 0.1 x, sigma 0.025 mm\n\n");
  fmt::print("{:<44}{:>10}{:>14}{:>14}\n", "", "ns/point", "line mm rms", "angle deg rms");
  const auto row = [&](std::string_view what, const char* ns, const Json& error) {
    fmt::print("{:<44}{:>10.2f}", what, result[ns].get<double>());
    if (error.is_null()) fmt::print("\n");
    if (!error.is_null())
      fmt::print("{:>14.4f}{:>14.4f}\n", error["line_error_mm"].get<double>(),
                 error["angle_error_deg"].get<double>());
  };
  row("floor: read x, y, z", "read_ns", nullptr);
  row("floor: largest second difference, line", "second_difference_ns", result["second_difference"]);
  row("ours: runs, boundary, line", "ours_ns", result["ours"]);
  row("  of which PlateRunFinder::find", "find_ns", nullptr);
  row("  a dirty frame (1 % outliers, 3 % missing)", "dirty_ns", result["dirty"]);
  fmt::print("{:<44}{:>10}{:>14.4f}{:>14.4f}\n", "  the dirty frame by second difference", "",
             result["dirty_second_difference"]["line_error_mm"].get<double>(),
             result["dirty_second_difference"]["angle_error_deg"].get<double>());
  fmt::print("measured elsewhere, on such a frame:\n");
  fmt::print("{:<44}{:>10.2f}{:>14}\n", "  largest second difference", 0.65, "0.0030");
  fmt::print("{:<44}{:>10.2f}   900 marks, none false\n", "  PCL 1.13 OrganizedEdgeBase", 42.0);
  fmt::print("{:<44}{:>10.0f}   733 marks at the edge, 968 elsewhere\n",
             "  PCL 1.13 normals + BoundaryEstimation", 7420.0);
  fmt::print("\nmeasured range images:\n");
  for (const auto& [name, image] : result["range_images"].items()) {
    if (image.is_null()) fmt::print("  {:<42}not there, skipped\n", name);
    if (!image.is_null())
      fmt::print("  {:<42}{:>10.2f}   {} points, {} runs\n", name, image["find_ns"].get<double>(),
                 image["points"].get<std::size_t>(), image["runs"].get<std::size_t>());
  }
  fmt::print("\nplan map inverse, from a neighbour's (u, v): {:.0f} ns a point\n",
             result["plan_map_inverse_ns"].get<double>());
}

}  // namespace

Json run_edges(const Options& options) {
  const int repeats = options.quick ? 5 : 101, frames = options.quick ? 5 : 100;
  const test::Frame clean = sample(shot(1, true)), dirty = sample(shot(1, false));
  const double points = 50'000;
  const auto ns = [&](auto&& work) { return time_of(repeats, work).median * 1e9 / points; };
  Ours ours;
  std::vector<EdgePoint> edge;
  edge.reserve(100);
  const auto by_difference = [&](std::span<const StripeView> stripes) -> std::optional<EdgeLine> {
    edges_by_second_difference(stripes, edge);
    if (edge.size() < 2) return std::nullopt;
    return fit_edge_line(edge);
  };

  Json result;
  result["points"] = static_cast<std::size_t>(points);
  result["read_ns"] = ns([&] { keep(read(clean.views)); });
  result["second_difference_ns"] = ns([&] { keep(by_difference(clean.views)->centre.x()); });
  result["ours_ns"] = ns([&] { keep(ours(clean.views)->centre.x()); });
  result["find_ns"] = ns([&] { keep(ours.finder.find(clean.views, {0, -20, 0}, {})->size()); });
  result["dirty_ns"] = ns([&] { keep(ours(dirty.views)->centre.x()); });
  result["ours"] = errors(true, frames, std::ref(ours));
  result["second_difference"] = errors(true, frames, by_difference);
  result["dirty"] = errors(false, frames, std::ref(ours));
  result["dirty_second_difference"] = errors(false, frames, by_difference);
  result["line_error_mm"] = result["ours"]["line_error_mm"];
  result["range_images"] = {
      {"StripGroove_image_9.json",
       range_image("StripGroove_image_9.json", 100, 450, {280, 300, 0}, 16500, repeats)},
      {"BlobFeatureTypes3D_image.json",
       range_image("BlobFeatureTypes3D_image.json", 60, 420, {390, 280, 0}, 10033, repeats)}};
  result["plan_map_inverse_ns"] = plan_map_inverse_ns(repeats);
  if (!options.quiet) print(result);
  return result;
}

}  // namespace moldloft::bench
