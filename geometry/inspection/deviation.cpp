#include "geometry/inspection/deviation.hpp"

#include "geometry/inspection/plain_motion.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>

namespace moldloft::geometry {

namespace {

// The foot of the point before is a fair start if the way from that point is a small part of the surface:
// farther away a descent could end in another valley.
constexpr double near_share = 0.05;

}  // namespace

std::expected<void, Flaw> measure_deviations(const PreparedSurface& surface,
                                             std::span<const Eigen::Vector3d> points,
                                             const DeviationSettings& settings, std::span<Deviation> out) {
  if (out.size() < points.size()) return std::unexpected(Flaw{Error::sizes_differ});
  const PlainMotion design_from_plate(settings.design_from_plate);
  const Box& all = surface.box(surface.levels() - 1, 0, 0);
  const double near_square = near_share * near_share * (all.high - all.low).squaredNorm();
  const bool by_plan = surface.is_explicit();
  Eigen::Vector3d before = Eigen::Vector3d::Constant(std::numeric_limits<double>::infinity());
  Parameters start;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Eigen::Vector3d p = design_from_plate * points[i];
    if (!can_be_measured(p))
      return std::unexpected(Flaw{p.allFinite() ? Error::too_large : Error::not_finite, i});
    FootPoint foot;
    if (by_plan) {
      start = surface.guess_of(p);
      foot = foot_near(surface, p, start.u, start.v, FootAccuracy::by_distance);
    } else if ((p - before).squaredNorm() < near_square) {
      foot = foot_near(surface, p, start.u, start.v, FootAccuracy::by_distance);
    }
    if (!foot.converged) foot = nearest_foot(surface, p).foot;
    before = p, start = {foot.u, foot.v};
    out[i] = {foot.signed_mm,   foot.u,     foot.v,
              foot.overhang_mm, foot.place, foot.overhang_mm > settings.border_tolerance_mm};
  }
  return {};
}

DeviationSummary summarize(std::span<const Deviation> deviations, std::span<double> scratch) {
  assert(scratch.size() >= deviations.size());
  DeviationSummary summary;
  double sum = 0, squares = 0;
  std::size_t count = 0;
  for (std::size_t i = 0; i < deviations.size(); ++i) {
    const Deviation& d = deviations[i];
    if (d.beyond_border) continue;
    if (count == 0 || d.mm < summary.least_mm) summary.least_mm = d.mm, summary.least_point = i;
    if (count == 0 || d.mm > summary.most_mm) summary.most_mm = d.mm, summary.most_point = i;
    sum += d.mm, squares += d.mm * d.mm;
    scratch[count++] = d.mm;
  }
  summary.count = count;
  summary.beyond_border = deviations.size() - count;
  if (count == 0) return summary;
  const double total = static_cast<double>(count);
  summary.mean_mm = sum / total;
  summary.rms_mm = std::sqrt(squares / total);
  // Ranks ascend, so each selection works on what the one before left above.
  auto from = scratch.begin();
  const auto end = scratch.begin() + static_cast<std::ptrdiff_t>(count);
  for (std::size_t k = 0; k < summary.percentiles_mm.size(); ++k) {
    const double rank = std::ceil(DeviationSummary::levels[k] * total);
    const auto at = scratch.begin() + static_cast<std::ptrdiff_t>(std::clamp(rank, 1.0, total)) - 1;
    std::nth_element(from, at, end);
    summary.percentiles_mm[k] = *at;
    from = at;
  }
  return summary;
}

DeviationMap::DeviationMap(const PreparedSurface& surface, std::span<DeviationCell> cells, int rows,
                           int columns)
    : cells_(cells),
      rows_(rows),
      columns_(columns),
      first_u_(surface.along_u().first()),
      first_v_(surface.along_v().first()),
      per_u_(rows / (surface.along_u().last() - first_u_)),
      per_v_(columns / (surface.along_v().last() - first_v_)) {
  assert(rows >= 1 && columns >= 1);
  assert(cells.size() == static_cast<std::size_t>(rows) * static_cast<std::size_t>(columns));
  std::ranges::fill(cells_, DeviationCell{});
}

void DeviationMap::add(std::span<const Deviation> deviations) {
  for (const Deviation& d : deviations) {
    if (d.beyond_border) continue;
    const int row = std::clamp(static_cast<int>((d.u - first_u_) * per_u_), 0, rows_ - 1);
    const int column = std::clamp(static_cast<int>((d.v - first_v_) * per_v_), 0, columns_ - 1);
    DeviationCell& cell = cells_[index(row, column)];
    cell.least_mm = cell.count == 0 ? d.mm : std::min(cell.least_mm, d.mm);
    cell.most_mm = cell.count == 0 ? d.mm : std::max(cell.most_mm, d.mm);
    cell.sum_mm += d.mm;
    ++cell.count;
  }
}

}  // namespace moldloft::geometry
