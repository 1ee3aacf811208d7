// What the examples of chapter 6 share: a known surface, stripes sampled from it along given lines, and how
// far a reconstruction is from the truth.
#pragma once

#include "bench/benchmark.hpp"
#include "geometry/splines/bspline.hpp"
#include "geometry/stripes/bspline_surface_fit.hpp"
#include "geometry/stripes/stripe_curve.hpp"

#include <Eigen/Core>

#include <functional>
#include <span>
#include <string>
#include <vector>

namespace moldloft::bench {

struct Line {  // in the unit square
  Eigen::Vector2d from, to;
};

// Ends the program with words on stderr: an example that cannot be computed is a fault of the benchmark.
[[noreturn]] void give_up(const std::string& words);

// The part of the line through `through` in `direction` that lies in the unit square.
Line within_square(const Eigen::Vector2d& through, const Eigen::Vector2d& direction);

struct SampledStripe {
  std::vector<Eigen::Vector2d> uv;
  std::vector<Eigen::Vector3d> points;
};

// `count` points at equal steps of the line's parameter.
SampledStripe sample_stripe(const geometry::BSplineSurface&, const Line&, int count);

struct Spread {
  double average = 0, deviation = 0, max = 0, min = 0;
};
Spread spread_of(std::span<const double>);
Json to_json(const Spread&);

// On 50 x 50 points of the unit square: the height's difference at equal parameters, as the thesis measures,
// and the distance from the reconstruction's points to the truth.
struct Comparison {
  Spread height, distance;
};
Comparison compare(const geometry::BSplineSurface& ours, const geometry::BSplineSurface& truth);

// The distance from a point to the surface near (u, v), by damped Newton steps within the domain.
double foot_distance(const geometry::BSplineSurface&, const Eigen::Vector3d&, Eigen::Vector2d uv);

// Control points at the Greville abscissae: x = u and y = v over the unit square, scaled by `size`.
geometry::BSplineSurface graph_surface(const std::vector<double>& knots_u, const std::vector<double>& knots_v,
                                       double size, const std::function<double(int, int)>& height);

// The bilinear Coons patch of the surface's boundary: the base of a fit, and its ring.
geometry::BSplineSurface coons_base(const geometry::BSplineSurface& surface);

struct StripeFit {
  geometry::BSplineSurface surface;
  geometry::MatchingReport report;
  double condition = 0;
};
// Stripes as cubic B-spline curves over `knots` with the parameter that is named, matched with `weight`.
StripeFit fit_stripes(std::span<const SampledStripe>, const std::vector<double>& knots,
                      const geometry::BSplineSurface& base, geometry::StripeParameter, geometry::PieceWeight);
// The points themselves, at their (u, v), with equal weight.
StripeFit fit_points(std::span<const SampledStripe>, const geometry::BSplineSurface& base);

}  // namespace moldloft::bench
