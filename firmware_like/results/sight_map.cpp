#include "firmware_like/results/sight_map.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <utility>

namespace moldloft::firmware_like {
namespace {

constexpr double finest_cell_mm = 2;
constexpr double cells_along = 400;  // of the longer side of the box, at most

// How far apart the runs of a shot lie, across the stripes: the median, so that a stripe that is missing widens none.
double spacing_of(const tasks::ShotSeen& shot, std::span<const tasks::SeenRun> runs) {
  const auto scanner_from_world = shot.world_from_scanner.inverse();
  std::vector<double> steps;
  double last = 0;
  for (std::size_t i = 0; i < runs.size(); ++i) {
    const double x = (scanner_from_world * runs[i].first).x();
    // Several runs of one stripe follow one another at the same x.
    if (i > 0 && std::abs(x - last) > 1e-3) steps.push_back(std::abs(x - last));
    last = x;
  }
  if (steps.empty()) return 0;
  std::ranges::nth_element(steps, steps.begin() + static_cast<std::ptrdiff_t>(steps.size() / 2));
  return steps[steps.size() / 2];
}

}  // namespace

SightMap::SightMap(const OutlineTrace& outline, const tasks::RunEvidence& evidence) {
  Eigen::Vector2d high = low_ = outline.points().front();
  for (const auto& p : outline.points()) low_ = low_.cwiseMin(p), high = high.cwiseMax(p);
  cell_mm_ = std::max(finest_cell_mm, (high - low_).maxCoeff() / cells_along);
  columns_ = static_cast<int>((high.x() - low_.x()) / cell_mm_) + 1;
  rows_ = static_cast<int>((high.y() - low_.y()) / cell_mm_) + 1;
  cells_.assign(static_cast<std::size_t>(columns_) * rows_, Cell::outside);
  fill_inside(outline);
  for (std::size_t i = 0; i < evidence.shots.size(); ++i) {
    const auto& shot = evidence.shots[i];
    if (!shot.plate_found) continue;
    const auto runs = evidence.runs_of(i);
    const Eigen::Vector2d across = shot.world_from_scanner.linear().col(0).head<2>().normalized();
    // A little more than half of what lies between two runs, so that they meet.
    const double half_width = std::max(0.6 * spacing_of(shot, runs), 0.75 * cell_mm_);
    for (const auto& run : runs) draw(run, across, half_width);
  }
}

// Cells whose four corners lie inside.
void SightMap::fill_inside(const OutlineTrace& outline) {
  std::vector<std::pair<double, double>> below, above;
  std::vector<double> x;
  const auto inside_at = [&](double y) {
    std::vector<std::pair<double, double>> spans;
    outline.crossings(y, x);
    for (std::size_t i = 0; i + 1 < x.size(); i += 2) spans.emplace_back(x[i], x[i + 1]);
    return spans;
  };
  const auto holds = [](const auto& spans, double from, double to) {
    return std::ranges::any_of(spans, [&](const auto& s) { return s.first <= from && to <= s.second; });
  };
  below = inside_at(low_.y());
  for (int row = 0; row < rows_; ++row) {
    above = inside_at(low_.y() + (row + 1) * cell_mm_);
    for (int column = 0; column < columns_; ++column) {
      const double from = low_.x() + column * cell_mm_, to = from + cell_mm_;
      if (holds(below, from, to) && holds(above, from, to)) at(column, row) = Cell::unseen;
    }
    below = std::move(above);
  }
}

void SightMap::draw(const tasks::SeenRun& run, const Eigen::Vector2d& across, double half_width_mm) {
  const Eigen::Vector2d from = run.first.head<2>(), way = run.last.head<2>() - from;
  const int steps = static_cast<int>(std::ceil(way.norm() / (cell_mm_ / 2)));
  const int aside = static_cast<int>(std::ceil(half_width_mm / (cell_mm_ / 2)));
  for (int i = 0; i <= steps; ++i) {
    const Eigen::Vector2d middle = from + way * (steps == 0 ? 0.0 : static_cast<double>(i) / steps);
    for (int k = -aside; k <= aside; ++k) {
      const Eigen::Vector2d p = (middle + across * (half_width_mm * k / aside) - low_) / cell_mm_;
      const int column = static_cast<int>(std::floor(p.x())), row = static_cast<int>(std::floor(p.y()));
      if (column < 0 || row < 0 || column >= columns_ || row >= rows_) continue;
      if (Cell& cell = at(column, row); cell == Cell::unseen) cell = Cell::seen;
    }
  }
}

std::vector<UnseenPart> SightMap::unseen() const {
  std::vector<Cell> left = cells_;
  std::vector<UnseenPart> parts;
  std::vector<std::pair<int, int>> open;
  const auto take = [&](int column, int row) {
    if (column < 0 || row < 0 || column >= columns_ || row >= rows_) return;
    Cell& cell = left[static_cast<std::size_t>(row) * columns_ + column];
    if (cell != Cell::unseen) return;
    cell = Cell::seen;
    open.emplace_back(column, row);
  };
  for (int row = 0; row < rows_; ++row) {
    for (int column = 0; column < columns_; ++column) {
      take(column, row);
      if (open.empty()) continue;
      UnseenPart part;
      part.low = part.high = low_ + cell_mm_ * Eigen::Vector2d{column, row};
      int cells = 0;
      while (!open.empty()) {
        const auto [c, r] = open.back();
        open.pop_back();
        const Eigen::Vector2d corner = low_ + cell_mm_ * Eigen::Vector2d{c, r};
        part.low = part.low.cwiseMin(corner);
        part.high = part.high.cwiseMax(corner + Eigen::Vector2d::Constant(cell_mm_));
        part.centre += corner + Eigen::Vector2d::Constant(cell_mm_ / 2);
        ++cells;
        for (int dr = -1; dr <= 1; ++dr)
          for (int dc = -1; dc <= 1; ++dc) take(c + dc, r + dr);
      }
      part.centre /= cells;
      part.area_mm2 = cells * cell_mm_ * cell_mm_;
      parts.push_back(part);
    }
  }
  std::ranges::sort(parts, std::ranges::greater{}, &UnseenPart::area_mm2);
  return parts;
}

}  // namespace moldloft::firmware_like
