#include "host_sim/plates/outline_grid.hpp"

#include <algorithm>
#include <cmath>

namespace moldloft::host_sim {

namespace {

constexpr double most_cells = 1e6;

double x_where(const Eigen::Vector2d& a, const Eigen::Vector2d& b, double y) noexcept {
  return (b.x() - a.x()) * (y - a.y()) / (b.y() - a.y()) + a.x();
}
double y_where(const Eigen::Vector2d& a, const Eigen::Vector2d& b, double x) noexcept {
  return (b.y() - a.y()) * (x - a.x()) / (b.x() - a.x()) + a.y();
}

}  // namespace

OutlineGrid::OutlineGrid(PlanPoints outline) {
  Eigen::Vector2d low = outline.front();
  high_ = low;
  double length = 0;
  for (std::size_t i = 0, j = outline.size() - 1; i < outline.size(); j = i++) {
    low = low.cwiseMin(outline[i]);
    high_ = high_.cwiseMax(outline[i]);
    length += (outline[i] - outline[j]).norm();
  }
  const Eigen::Vector2d size = high_ - low;
  // A cell as large as a side holds two or three of them.
  const double cell =
      std::max(length / static_cast<double>(outline.size()), std::sqrt(size.x() * size.y() / most_cells));
  raster_ = PlanRaster::over(low, high_, cell);
  cells_.resize(raster_.cells());
  list_sides(outline);
  find_middles(outline);
}

void OutlineGrid::list_sides(PlanPoints outline) {
  const auto for_cells = [&](auto&& visit) {
    for (std::size_t i = 0, j = outline.size() - 1; i < outline.size(); j = i++) {
      const Eigen::Vector2d side[] = {outline[j], outline[i]};
      raster_.for_rows(side, 1e-6 * raster_.cell_mm, [&](int row, int first, int last) {
        for (int column = first; column <= last; ++column)
          visit(cells_[raster_.index(column, row)], Side{outline[j], outline[i]});
      });
    }
  };
  listed_ = listed_by_cell<Side>(cells_, for_cells);
}

void OutlineGrid::find_middles(PlanPoints outline) {
  std::vector<std::vector<double>> crossings(static_cast<std::size_t>(raster_.rows));
  for (std::size_t i = 0, j = outline.size() - 1; i < outline.size(); j = i++) {
    const auto &a = outline[i], &b = outline[j];
    for (int row = raster_.row(std::min(a.y(), b.y())); row <= raster_.row(std::max(a.y(), b.y())); ++row) {
      const double y = raster_.centre(0, row).y();
      if ((a.y() > y) != (b.y() > y)) crossings[static_cast<std::size_t>(row)].push_back(x_where(a, b, y));
    }
  }
  for (int row = 0; row < raster_.rows; ++row) {
    auto& xs = crossings[static_cast<std::size_t>(row)];
    std::sort(xs.begin(), xs.end());
    std::size_t left = 0;
    for (int column = 0; column < raster_.columns; ++column) {
      while (left < xs.size() && xs[left] <= raster_.centre(column, row).x()) ++left;
      cells_[raster_.index(column, row)].middle_inside = (xs.size() - left) % 2 == 1;
    }
  }
}

bool OutlineGrid::contains(double x, double y) const noexcept {
  if (!(x >= raster_.low.x() && y >= raster_.low.y() && x <= high_.x() && y <= high_.y())) return false;
  const int column = raster_.column(x), row = raster_.row(y);
  const auto& cell = cells_[raster_.index(column, row)];
  const Eigen::Vector2d middle = raster_.centre(column, row);
  bool in = cell.middle_inside;
  for (std::uint32_t k = 0; k < cell.count; ++k) {
    const auto& [a, b] = listed_[cell.first + k];
    if ((a.y() > y) != (b.y() > y)) {
      const double at = x_where(b, a, y);
      if ((x < at) != (middle.x() < at)) in = !in;
    }
    if ((a.x() > middle.x()) != (b.x() > middle.x())) {
      const double at = y_where(b, a, middle.x());
      if ((y < at) != (middle.y() < at)) in = !in;
    }
  }
  return in;
}

}  // namespace moldloft::host_sim
