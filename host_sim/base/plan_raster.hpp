// Square cells over a part of the plan, and which of them something covers.
//
// Cost         for_rows: linear in the rows touched, so that long oblique shapes cost no more than they cover
// Allocation   in listed_by_cell() only
#pragma once

#include <Eigen/Core>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

namespace moldloft::host_sim {

struct PlanRaster {
  Eigen::Vector2d low = Eigen::Vector2d::Zero();  // mm, of the first cell
  double cell_mm = 1;
  int columns = 1, rows = 1;

  static PlanRaster over(const Eigen::Vector2d& low, const Eigen::Vector2d& high, double cell_mm) {
    return {low, cell_mm, static_cast<int>((high.x() - low.x()) / cell_mm) + 1,
            static_cast<int>((high.y() - low.y()) / cell_mm) + 1};
  }
  std::size_t cells() const noexcept {
    return static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows);
  }
  // Places outside take the nearest cell; they may be as far away as they like.
  int column(double x) const noexcept {
    return static_cast<int>(std::clamp((x - low.x()) / cell_mm, 0.0, columns - 1.0));
  }
  int row(double y) const noexcept {
    return static_cast<int>(std::clamp((y - low.y()) / cell_mm, 0.0, rows - 1.0));
  }
  std::size_t index(int column, int row) const noexcept {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(columns) +
           static_cast<std::size_t>(column);
  }
  std::size_t cell_at(double x, double y) const noexcept { return index(column(x), row(y)); }
  Eigen::Vector2d centre(int column, int row) const noexcept {
    return low + cell_mm * Eigen::Vector2d{column + 0.5, row + 0.5};
  }

  // visit(row, first column, last column) for all rows that a line or a triangle comes within `slack_mm` of.
  template <typename Visit>
  void for_rows(std::span<const Eigen::Vector2d> shape, double slack_mm, Visit&& visit) const {
    double y_low = shape.front().y(), y_high = y_low;
    for (const auto& p : shape) y_low = std::min(y_low, p.y()), y_high = std::max(y_high, p.y());
    for (int j = row(y_low - slack_mm); j <= row(y_high + slack_mm); ++j) {
      const double bottom = low.y() + cell_mm * j - slack_mm, top = bottom + cell_mm + 2 * slack_mm;
      double left = std::numeric_limits<double>::infinity(), right = -left;
      const auto take = [&](double x) { left = std::min(left, x), right = std::max(right, x); };
      for (std::size_t k = 0; k < shape.size(); ++k) {
        const auto &a = shape[k], &b = shape[(k + 1) % shape.size()];
        if (a.y() >= bottom && a.y() <= top) take(a.x());
        for (const double y : {bottom, top}) {
          if ((a.y() < y) != (b.y() < y)) take(a.x() + (b.x() - a.x()) * ((y - a.y()) / (b.y() - a.y())));
        }
      }
      if (left <= right) visit(j, column(left - slack_mm), column(right + slack_mm));
    }
  }
};

// What each cell covers, in one list with a cell's items side by side: cell.first and cell.count say which are its own.
// for_cells(visit) calls visit(cell, item) for all pairs; it is called twice, to count and to list.
template <typename Item, typename Cells, typename ForCells>
std::vector<Item> listed_by_cell(Cells& cells, ForCells&& for_cells) {
  for_cells([](auto& cell, const Item&) { ++cell.count; });
  std::uint32_t first = 0;
  for (auto& cell : cells) {
    cell.first = first;
    first += cell.count;
    cell.count = 0;
  }
  std::vector<Item> listed(first);
  for_cells([&](auto& cell, const Item& item) { listed[cell.first + cell.count++] = item; });
  return listed;
}

}  // namespace moldloft::host_sim
