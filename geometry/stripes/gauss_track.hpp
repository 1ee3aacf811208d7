// A stripe whose pre-image is a curve: points of it at Gauss nodes, weighted by length in (u, v), to be
// given to BSplineSurfaceFit as a sampled track. Coefficients cannot be matched there (the composition's
// degree would be 18), but the least squares sum over the nodes is the integral of the squared distance
// along the pre-image.
//
// Source       Golub and Welsch 1969 for what the nodes are; here by Newton steps on the Legendre recurrence
// Accuracy     nodes and weights within 8 eps; the integral is exact where the integrand is of degree 2 nodes
//              - 1 between the knots of stripe and pre-image, and asymptotically so across
//              the surface's knots
// Cost         a curve point a node
// Allocation   what is returned
// Failure      none here; a pre-image that leaves the domain is refused by assemble()
#pragma once

#include "geometry/stripes/bspline_surface_fit.hpp"

#include <span>
#include <vector>

namespace moldloft::geometry {

struct GaussRule {
  std::vector<double> node, weight;  // on [0, 1]; the weights add up to 1
};
GaussRule gauss_rule(int nodes);  // 1 to 64

struct GaussTrack {
  SampledTrack track;
  std::vector<double>
      t;  // where the stripe is to be evaluated: track.uv[i] is the pre-image of its point at t[i]
};

// `nodes` on every span between the knots of both curves, which share their parameter.
GaussTrack gauss_track(const PlanCurve& preimage_uv, std::span<const double> stripe_knots, int nodes = 5);

SampledPoints points_at(const SpaceCurve& stripe, std::span<const double> t);

}  // namespace moldloft::geometry
