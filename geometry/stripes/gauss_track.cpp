#include "geometry/stripes/gauss_track.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <iterator>
#include <numbers>

namespace moldloft::geometry {

GaussRule gauss_rule(int nodes) {
  assert(nodes >= 1 && nodes <= 64);
  GaussRule rule{std::vector<double>(nodes), std::vector<double>(nodes)};
  for (int i = 0; i < nodes; ++i) {
    double x = std::cos(std::numbers::pi * (i + 0.75) / (nodes + 0.5)), slope = 1;
    constexpr int steps = 6;  // quadratic from a start that is good to 1e-2
    for (int step = 0; step < steps; ++step) {
      double last = 1, value = x;
      for (int k = 2; k <= nodes; ++k) {
        const double next = ((2 * k - 1) * x * value - (k - 1) * last) / k;
        last = value, value = next;
      }
      slope = nodes == 1 ? 1 : nodes * (x * value - last) / (x * x - 1);
      x -= value / slope;
    }
    rule.node[nodes - 1 - i] = (1 + x) / 2;
    rule.weight[nodes - 1 - i] = 1 / ((1 - x * x) * slope * slope);
  }
  return rule;
}

GaussTrack gauss_track(const PlanCurve& preimage_uv, std::span<const double> stripe_knots, int nodes) {
  const auto inner = [](std::span<const double> knots) {
    return knots.subspan(cubic, knots.size() - 2 * cubic);
  };
  const auto a = inner(preimage_uv.knots), b = inner(stripe_knots);
  std::vector<double> breaks;
  std::ranges::merge(a, b, std::back_inserter(breaks));
  breaks.erase(std::ranges::unique(breaks).begin(), breaks.end());

  const GaussRule rule = gauss_rule(nodes);
  GaussTrack gauss;
  for (std::size_t s = 0; s + 1 < breaks.size(); ++s) {
    const double h = breaks[s + 1] - breaks[s];
    for (int n = 0; n < nodes; ++n) {
      const double t = breaks[s] + h * rule.node[n];
      const auto point = preimage_uv.at(t);
      gauss.t.push_back(t);
      gauss.track.uv.push_back(point.value);
      gauss.track.weight.push_back(h * rule.weight[n] * point.first.norm());
    }
  }
  return gauss;
}

SampledPoints points_at(const SpaceCurve& stripe, std::span<const double> t) {
  SampledPoints points;
  points.reserve(t.size());
  for (const double at : t) points.push_back(stripe.at(at).value);
  return points;
}

}  // namespace moldloft::geometry
