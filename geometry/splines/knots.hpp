// Clamped knot vectors of any degree: n control points of degree p stand over n + p + 1 knots, the first p +
// 1 alike and the last p + 1 alike (thesis section 2.4).
//
// Units        parameters; the surfaces of this project live on [0, 1], nothing here asks for that
// Cost         find_span is constant where knots are nearly uniform, logarithmic where they are not
// Allocation   what is returned
// Failure      check_knots() names what is wrong with knots from outside; all else expects knots
//              that passed it
#pragma once

#include "geometry/error.hpp"
#include "geometry/nonblocking.hpp"

#include <expected>
#include <span>
#include <vector>

namespace moldloft::geometry {

constexpr int cubic = 3;
constexpr int most_spline_degree = 31;  // sizes the scratch space that evaluation keeps on the stack

// Clamped knots on [0, 1] with `spans` equal spans: (0,0,0,0, 1/s, ..., 1,1,1,1). Control points:
// spans + degree.
std::vector<double> uniform_clamped_knots(int spans, int degree = cubic);

// What from outside may be wrong, in this order: knots_wrong_count (n + p + 1 are due, n > p), not_finite,
// knots_not_increasing, knots_not_clamped (or a domain without length), knot_too_often (an interior knot
// stands more than p times: the spline would fall apart there).
std::expected<void, Error> check_knots(std::span<const double> knots, int degree, int control_points);

// The same for knots that decide themselves how many control points there are.
std::expected<void, Error> check_cubic_knots(std::span<const double> knots);

// The span index k with knots[k] <= t < knots[k+1] (the last span for t = 1); t is clamped to the domain.
inline int find_span(std::span<const double> knots, double t, int degree = cubic);

// How many knots equal t.
int multiplicity(std::span<const double> knots, double t);

// The first knot of every span that is not empty, as indices: the pieces on which a spline is one polynomial.
std::vector<int> filled_spans(std::span<const double> knots, int degree = cubic);

// The Greville abscissa of control point i: where a control point sits on a straight line at unit speed.
double greville(std::span<const double> knots, int i, int degree = cubic);

// Every knot that stands in any of the vectors, as often as in the one that has it most. Knots that differ by
// no more than `tolerance` from the least of them count as one, which takes that least value. The order of
// the vectors does not matter. At tolerance 0 every curve over one of them can be refined to the result
// without a change.
std::vector<double> merge_knots(std::span<const std::vector<double>> all, double tolerance = 0);
std::vector<double> merge_knots(std::vector<double> a, std::vector<double> b, double tolerance = 0);

// `knots` with every value moved onto the nearest of `onto` if that is no farther than `tolerance`. Moves a
// curve by at most tolerance times its largest derivative, to first order.
std::vector<double> snap_knots(std::span<const double> knots, std::span<const double> onto, double tolerance);

// Knots for interpolation at increasing parameters, one control point each: every interior knot is the mean
// of `degree` consecutive parameters, so that Schoenberg and Whitney are content (de Boor 1978).
std::vector<double> averaged_knots(std::span<const double> parameters, int degree = cubic);

// Knots for least squares at increasing parameters: interior knots such that every span holds about the
// same number of them, and at least one (Piegl and Tiller, The NURBS Book, eq. 9.69). degree <
// control_points <= parameters.
std::vector<double> balanced_knots(std::span<const double> parameters, int control_points,
                                   int degree = cubic);

// How find_span() looks when the span is not where uniform knots would have it.
int search_span(std::span<const double> knots, double t, int degree) MOLDLOFT_GEOMETRY_NONBLOCKING;

inline int find_span(std::span<const double> knots, double t, int degree) {
  const double* k = knots.data();
  const int last = static_cast<int>(knots.size()) - degree - 2;
  const double begin = k[degree], end = k[last + 1];
  if (t > begin && t < end) {
    const int guess = degree + static_cast<int>((t - begin) / (end - begin) * (last + 1 - degree));
    if (guess <= last && k[guess] <= t && t < k[guess + 1]) return guess;
  }
  return search_span(knots, t, degree);
}

}  // namespace moldloft::geometry
