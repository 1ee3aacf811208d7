// Which of several nets over the same points: by what it is expected to miss on points not seen.
//
// Source       generalized cross-validation (Craven and Wahba 1979), with the degrees of freedom inflated
//              against undersmoothing (Kim and Gu 2004); BIC (Schwarz 1978)
// Tolerance    GCV is a mean squared error of prediction, so the difference of two scores is the square of
//              what the coarser net misses: the coarsest net within tolerance^2 of the best is taken
#pragma once

#include "geometry/fit/net_solver.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>

namespace moldloft::geometry {

// The coarsest of the nets to choose from, in each direction. A plan map's sides have as many spans, and a net
// must refine theirs.
constexpr int fewest_spans = 4;

// A net is tried when it has at least this many points for every unknown.
constexpr double points_an_unknown = 4;

enum class NetCriterion { gcv, bic };

// How well a net fits its points. The residuals are weighted; sigma is over the degrees of freedom.
struct NetScore {
  int spans_u = 0, spans_v = 0;
  double gcv = 0, bic = 0, rms_residual = 0, sigma = 0, smallest_pivot = 0;
  int empty_cells = 0;
};

// What the poses of shots leave behind, beside their offsets, is not independent from point to point, and
// plain cross-validation would spend control points on it.
constexpr double dof_inflation = 1.4;

inline double generalized_cross_validation(const PointTotals& totals, const NetResult& result) {
  const double n = static_cast<double>(totals.points);
  const double free = 1 - dof_inflation * result.freedom / n;
  return free > 0 ? result.squares / n / (free * free) : std::numeric_limits<double>::infinity();
}

inline double bayesian_information(const PointTotals& totals, const NetResult& result) {
  const double n = static_cast<double>(totals.points);
  return n * std::log(result.squares / n) + result.freedom * std::log(n);
}

inline NetScore score_of(const SplineNet& net, const PointTotals& totals, const NetResult& result) {
  const double free = std::max(1.0, static_cast<double>(totals.points) - result.freedom);
  return {.spans_u = net.cells_u(),
          .spans_v = net.cells_v(),
          .gcv = generalized_cross_validation(totals, result),
          .bic = bayesian_information(totals, result),
          .rms_residual = std::sqrt(result.squares / totals.weight),
          .sigma = std::sqrt(result.squares / free),
          .smallest_pivot = result.smallest_pivot,
          .empty_cells = result.empty_cells};
}

// The place of the choice among nets listed from fine to coarse.
inline std::size_t choose_net(std::span<const NetScore> nets, NetCriterion criterion, double tolerance) {
  std::size_t best = 0;
  for (std::size_t k = 1; k < nets.size(); ++k) {
    const bool better =
        criterion == NetCriterion::gcv ? nets[k].gcv <= nets[best].gcv : nets[k].bic <= nets[best].bic;
    if (better) best = k;
  }
  const double limit = nets[best].gcv + tolerance * tolerance;
  std::size_t chosen = best;
  for (std::size_t k = best + 1; k < nets.size(); ++k) {
    if (nets[k].gcv <= limit) chosen = k;
  }
  return chosen;
}

}  // namespace moldloft::geometry
