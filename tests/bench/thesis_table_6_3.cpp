// Table 6.3: a bicubic B-spline surface of 64 to 529 control points through 74 stripes, boundary given.
#include "bench/stopwatch.hpp"
#include "bench/thesis.hpp"
#include "bench/thesis_simulated_plate.hpp"

#include <fmt/core.h>

#include <array>

namespace moldloft::bench {

using namespace geometry;

namespace {

struct Published {
  int control;  // along one axis
  double seconds;
};
constexpr std::array published_6_3{Published{8, 11.7},  Published{11, 14.1}, Published{14, 19.2},
                                   Published{17, 21.5}, Published{20, 25.1}, Published{23, 29.1}};

struct Stripes {
  std::vector<StripeTrack> tracks;
  std::vector<SpaceCurve> curves;
};

Stripes curves_of(std::span<const SampledStripe> sampled, const std::vector<double>& knots) {
  Stripes stripes;
  for (const SampledStripe& stripe : sampled) {
    auto curve = fit_stripe(stripe.points, stripe.uv, knots, StripeParameter::consistent);
    if (!curve) continue;
    stripes.tracks.push_back(std::move(curve->track)), stripes.curves.push_back(std::move(curve->curve));
  }
  return stripes;
}

// Control points on the plate itself: a ring for the fit to keep.
BSplineSurface plate_base(int control) {
  const auto knots = uniform_clamped_knots(control - 3);
  return graph_surface(knots, knots, plate_size_mm, [&](int i, int j) {
    return plate_height(plate_size_mm * greville(knots, i), plate_size_mm * greville(knots, j));
  });
}

struct Times {
  double assemble_s = 0, solve_s = 0, both_s = 0;
  int pieces = 0;
  double pivot = 0;
  bool solved = false;
};

Times times_of(const Stripes& stripes, int control, int runs) {
  const BSplineSurface base = plate_base(control);
  Times times;
  const auto assemble = [&] {
    return BSplineSurfaceFit::assemble(base.knots_u, base.knots_v, stripes.tracks, {},
                                       {.weight = PieceWeight::one});
  };
  const auto fit = assemble();
  if (!fit) return times;
  times.solved = true;
  times.pieces = fit->report().pieces, times.pivot = fit->report().pivot.smallest;
  times.assemble_s = time_of(runs, [&] { keep(assemble().has_value()); }).least;
  times.solve_s = time_of(runs, [&] { keep(fit->solve(stripes.curves, {}, base)->z(1, 1)); }).least;
  times.both_s = time_of(runs, [&] { keep(assemble()->solve(stripes.curves, {}, base)->z(1, 1)); }).least;
  return times;
}

}  // namespace

Json thesis_table_6_3(const Options& options) {
  constexpr int count = 74;
  // As the thesis's plate gives them, a third of the plate long; and as one long shot would, from
  // border to border.
  const Stripes shots =
      curves_of(plate_stripes(count, 200, {height_noise_mm, 0}, 63), uniform_clamped_knots(1));
  std::vector<SampledStripe> across;
  const BSplineSurface plate = plate_base(63);
  for (int s = 0; s < count; ++s) {
    const double share = (s + 0.5) / count;
    across.push_back(sample_stripe(plate, within_square({1.2 * share - 0.2, 0}, {0.2, 1}), 200));
  }
  const Stripes full = curves_of(across, uniform_clamped_knots(17));
  if (!options.quiet) {
    fmt::print(
        "\nTable 6.3: bicubic B-spline surface through 74 stripes, boundary given, three right-hand sides\n");
    fmt::print("{:>7} {:>9} | {:^49} | {:^49}\n", "", "", "stripes of nine shots, one cubic each",
               "from border to border, 20 control points each");
    fmt::print("{:>7} {:>9} | {:>7} {:>11} {:>9} {:>9} {:>9} | {:>7} {:>11} {:>9} {:>9} {:>9}\n", "control",
               "thesis s", "pieces", "assemble ms", "solve ms", "all ms", "pivot", "pieces", "assemble ms",
               "solve ms", "all ms", "pivot");
  }
  Json table = Json::array();
  for (const auto& published : published_6_3) {
    const int runs = options.quick ? 5 : 31;
    const Times short_ones = times_of(shots, published.control, runs);
    const Times long_ones = times_of(full, published.control, runs);
    const auto json = [](const Times& t) {
      return Json{{"pieces", t.pieces},  {"assemble_s", t.assemble_s}, {"solve_again_s", t.solve_s},
                  {"seconds", t.both_s}, {"smallest_pivot", t.pivot},  {"solved", t.solved}};
    };
    table.push_back({{"control_points", published.control * published.control},
                     {"published_s", published.seconds},
                     {"ours_s", short_ones.both_s},
                     {"shots", json(short_ones)},
                     {"border_to_border", json(long_ones)}});
    if (options.quiet) continue;
    const auto text = [](const Times& t) {
      return fmt::format("{:7} {:11.3f} {:9.3f} {:9.3f} {:9.1e}", t.pieces, 1e3 * t.assemble_s,
                         1e3 * t.solve_s, 1e3 * t.both_s, t.pivot);
    };
    fmt::print("{:7} {:9.1f} | {} | {}\n", published.control * published.control, published.seconds,
               text(short_ones), text(long_ones));
  }
  return table;
}

}  // namespace moldloft::bench
