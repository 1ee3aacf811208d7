// Sections 6.3 and 6.4: the car hood and the fuselage. The thesis prints how many curves, pieces and knots
// there are, not the control nets; these are stand-ins of the same structure, so that the errors can be
// known at all.
#include "bench/thesis.hpp"
#include "bench/thesis_parts.hpp"

#include <fmt/core.h>

#include <cmath>
#include <numbers>
#include <string>

namespace moldloft::bench {

using namespace geometry;
using Eigen::Vector2d;

namespace {

struct Shape {
  std::string name, structure;
  BSplineSurface truth;
  std::vector<Line> lines;
  std::vector<double> stripe_knots;
  int published_curves, published_pieces, published_patches, published_control;
};

// The left half of a hood, 1.4 m by 0.75 m: flat along the middle, falling off to the wing and to the front.
Shape hood() {
  Shape shape{"hood", "6.3 Car hood", {}, {}, uniform_clamped_knots(1), 17, 37, 25, 64};
  const auto knots = uniform_clamped_knots(5);
  shape.truth = graph_surface(knots, knots, 1, [](int, int) { return 0.0; });
  for (int i = 0; i < 8; ++i) {
    for (int j = 0; j < 8; ++j) {
      const double u = greville(knots, i), v = greville(knots, j);  // u to the front, v to the wing
      shape.truth.x(i, j) = 1400 * u + 60 * v * v * (u - 0.3);
      shape.truth.y(i, j) = 750 * v * (1 - 0.12 * u * u);
      shape.truth.z(i, j) = 900 - 90 * v * v * v - 160 * u * u * u + 25 * std::sin(3 * u) * (1 - v) * (1 - v);
    }
  }
  // Sketch curves: most cross one knot line (two pieces), three of them two.
  for (int s = 0; s < 14; ++s) {
    const double across = 0.1 + 0.2 * (s % 5) + 0.012 * (s - 7), knot = 0.2 * (1 + s % 4);
    const double first = knot - 0.15, last = knot + 0.17;
    shape.lines.push_back(s % 2 == 0 ? Line{{across, first}, {across, last}}
                                     : Line{{first, across}, {last, across}});
  }
  for (int s = 0; s < 3; ++s) {
    const double across = 0.25 + 0.25 * s;
    shape.lines.push_back({{0.1 + 0.2 * s, across}, {0.52 + 0.2 * s, across}});
  }
  return shape;
}

// A panel of a fuselage, 2 m long: 70 degrees of a circle of 1.8 m that tapers towards the nose.
Shape fuselage() {
  Shape shape{"fuselage", "6.4 Fuselage", {}, {}, uniform_clamped_knots(7), 7, 57, 4, 25};
  const auto knots = uniform_clamped_knots(2);
  shape.truth = graph_surface(knots, knots, 1, [](int, int) { return 0.0; });
  for (int i = 0; i < 5; ++i) {
    for (int j = 0; j < 5; ++j) {
      const double u = greville(knots, i), v = greville(knots, j);
      const double radius = 1800 - 350 * u * u, angle = (v - 0.5) * 70 * std::numbers::pi / 180;
      shape.truth.x(i, j) = 2000 * u;
      shape.truth.y(i, j) = radius * std::sin(angle);
      shape.truth.z(i, j) = radius * std::cos(angle);
    }
  }
  // Seven curves of seven spans round the panel; each crosses the middle line, one of them the other one too.
  for (int s = 0; s < 6; ++s) {
    const double at = (s < 3 ? 0.08 : 0.56) + 0.15 * (s % 3);
    shape.lines.push_back({{at, 0}, {at + 0.04, 1}});
  }
  shape.lines.push_back({{0.44, 0}, {0.55, 1}});
  return shape;
}

Json reconstruct(const Shape& shape, const Options& options) {
  const BSplineSurface base = coons_base(shape.truth);
  std::vector<SampledStripe> stripes;
  for (const Line& line : shape.lines) stripes.push_back(sample_stripe(shape.truth, line, 81));
  const auto fit = [&](StripeParameter parameter, PieceWeight weight) {
    return fit_stripes(stripes, shape.stripe_knots, base, parameter, weight);
  };
  const StripeFit chord = fit(StripeParameter::chord_length, PieceWeight::one);
  const StripeFit consistent = fit(StripeParameter::consistent, PieceWeight::one);
  const StripeFit weighted = fit(StripeParameter::consistent, PieceWeight::length);
  const Comparison of_base = compare(base, shape.truth), of_chord = compare(chord.surface, shape.truth),
                   of_consistent = compare(consistent.surface, shape.truth),
                   of_weighted = compare(weighted.surface, shape.truth);
  const auto cells = static_cast<int>((shape.truth.knots_u.size() - 7) * (shape.truth.knots_v.size() - 7));
  Json json{{"stand_in", true},
            {"published",
             {{"curves", shape.published_curves},
              {"pieces", shape.published_pieces},
              {"patches", shape.published_patches},
              {"control_points", shape.published_control}}},
            {"ours",
             {{"curves", stripes.size()},
              {"pieces", chord.report.pieces},
              {"patches", cells},
              {"control_points", shape.truth.x.size()},
              {"smallest_pivot", chord.report.pivot.smallest},
              {"distance_mm",
               {{"coons_base", to_json(of_base.distance)},
                {"chord_length", to_json(of_chord.distance)},
                {"consistent", to_json(of_consistent.distance)},
                {"consistent_by_length", to_json(of_weighted.distance)}}}}}};
  if (options.quiet) return json;
  fmt::print("\n{}: a stand-in of the same structure (the thesis prints no control net and no error)\n",
             shape.structure);
  fmt::print(
      "  thesis: {} curves in {} pieces on {} patches, {} control points; here: {} in {} on {}, {}; smallest "
      "pivot {:.1e}\n",
      shape.published_curves, shape.published_pieces, shape.published_patches, shape.published_control,
      stripes.size(), chord.report.pieces, cells, shape.truth.x.size(), chord.report.pivot.smallest);
  fmt::print(
      "  distance to the generating surface, mm, avg / max: base {:.3g} / {:.3g}; chord length (the thesis) "
      "{:.3g} / {:.3g}; "
      "consistent {:.3g} / {:.3g}; by length {:.3g} / {:.3g}\n",
      of_base.distance.average, of_base.distance.max, of_chord.distance.average, of_chord.distance.max,
      of_consistent.distance.average, of_consistent.distance.max, of_weighted.distance.average,
      of_weighted.distance.max);
  return json;
}

}  // namespace

Json thesis_hood(const Options& options) { return reconstruct(hood(), options); }
Json thesis_fuselage(const Options& options) { return reconstruct(fuselage(), options); }

}  // namespace moldloft::bench
