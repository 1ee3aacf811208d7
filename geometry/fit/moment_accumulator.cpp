#include "geometry/fit/moment_accumulator.hpp"

#include "geometry/splines/bspline.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace moldloft::geometry {

namespace {

std::expected<void, Flaw> check_point(const PointColumns& columns, std::size_t i, const FitDomain& domain) {
  const double u = columns.u[i], v = columns.v[i], z = columns.z[i];
  const double w = columns.weight.empty() ? 1 : columns.weight[i];
  if (!std::isfinite(u) || !std::isfinite(v) || !std::isfinite(z) || !std::isfinite(w)) {
    return std::unexpected(Flaw{Error::not_finite, i});
  }
  if (w < 0) return std::unexpected(Flaw{Error::negative_weight, i});
  if (u < domain.min_u || u > domain.max_u || v < domain.min_v || v > domain.max_v) {
    return std::unexpected(Flaw{Error::outside_domain, i});
  }
  return {};
}

UniformCells uniform_cells(const MomentGrid& grid, const FitDomain& domain) {
  return {.cells_u = grid.cells_u(),
          .cells_v = grid.cells_v(),
          .scale_u = grid.cells_u() / (domain.max_u - domain.min_u),
          .scale_v = grid.cells_v() / (domain.max_v - domain.min_v),
          .origin_u = domain.min_u,
          .origin_v = domain.min_v};
}

}  // namespace

std::expected<void, Flaw> check_net_knots(std::span<const double> knots) {
  const auto good = check_cubic_knots(knots);
  if (good) return {};
  const std::size_t n = knots.size();
  const auto first_where = [&](auto&& wrong) {
    std::size_t i = 0;
    while (i < n && !wrong(i)) ++i;
    return i;
  };
  const auto blame = [&](std::size_t where) { return std::unexpected(Flaw{good.error(), where}); };
  switch (good.error()) {
    case Error::not_finite:
      return blame(first_where([&](std::size_t i) { return !std::isfinite(knots[i]); }));
    case Error::knots_not_increasing:
      return blame(first_where([&](std::size_t i) { return i > 0 && knots[i] < knots[i - 1]; }));
    case Error::knots_not_clamped:
      return blame(first_where([&](std::size_t i) {
        return i <= cubic ? knots[i] != knots[0] : i + cubic + 1 >= n && knots[i] != knots[n - 1];
      }));
    case Error::knot_too_often:  // beyond the third, at an end beyond the fourth
      return blame(first_where([&](std::size_t i) {
        const bool at_end = knots[i] == knots[0] || knots[i] == knots[n - 1];
        const std::size_t most = at_end ? cubic + 1 : cubic;
        return i >= most && knots[i] == knots[i - most];
      }));
    default:
      return blame(n);
  }
}

MomentAccumulator::MomentAccumulator(int cells_u, int cells_v, const FitDomain& domain, double datum,
                                     Simd simd)
    : grid_(cells_u, cells_v), domain_(domain), datum_(datum), kernel_(&moment_kernel(simd)) {
  assert(domain.min_u < domain.max_u && domain.min_v < domain.max_v);
}

MomentAccumulator::MomentAccumulator(const SplineNet& net, double datum, Simd simd)
    : grid_(net.cells_u(), net.cells_v()),
      domain_{net.spans_u()[0].begin, net.spans_u()[net.cells_u() - 1].end, net.spans_v()[0].begin,
              net.spans_v()[net.cells_v() - 1].end},
      datum_(datum),
      kernel_(&moment_kernel(simd)),
      lookup_(std::make_shared<const std::pair<KnotCells, KnotCells>>(net.spans_u().cells(),
                                                                      net.spans_v().cells())) {}

std::size_t MomentAccumulator::bytes() const {
  return grid_.bytes() + (lookup_ ? lookup_->first.bytes() + lookup_->second.bytes() : 0);
}

void MomentAccumulator::clear() { grid_.clear(); }

void MomentAccumulator::merge(const MomentAccumulator& other) {
  assert(other.domain_ == domain_ && other.datum_ == datum_);
  grid_.add(other.grid_);
}

void MomentAccumulator::subtract(const MomentAccumulator& other) {
  assert(other.domain_ == domain_ && other.datum_ == datum_);
  grid_.subtract(other.grid_);
}

PointTotals MomentAccumulator::totals() const {
  PointTotals totals;
  for (int i = 0; i < grid_.cells_u(); ++i) {
    for (int j = 0; j < grid_.cells_v(); ++j) {
      totals.points += grid_.points(i, j);
      totals.weight += grid_.cell(i, j).weight();
      totals.squares += grid_.cell(i, j).squares();
    }
  }
  return totals;
}

std::expected<void, Flaw> MomentAccumulator::read(const PointColumns& columns, std::size_t first,
                                                  PointBlock& block) const {
  alignas(64) double room[4][PointBlock::capacity];
  block.count = static_cast<int>(std::min<std::size_t>(PointBlock::capacity, columns.size() - first));
  block.weighted = !columns.weight.empty();
  const double* const u = columns.u.block(first, block.count, room[0]);
  const double* const v = columns.v.block(first, block.count, room[1]);
  const double* const z = columns.z.block(first, block.count, room[2]);
  for (int k = 0; k < block.count; ++k) block.height[k] = z[k] - datum_;
  if (block.weighted) {
    const double* const w = columns.weight.block(first, block.count, room[3]);
    std::copy(w, w + block.count, block.weight);
  }
  std::expected<void, Flaw> good;
  const auto check = [&] {
    for (int k = 0; k < block.count; ++k) {
      good = check_point(columns, first + static_cast<std::size_t>(k), domain_);
      if (good) continue;
      block.count = k;
      return;
    }
  };
  if (lookup_ == nullptr) {
    const UniformCells cells = uniform_cells(grid_, domain_);
    if (!kernel_->locate(block, u, v, cells)) {
      // Rounding may carry a point of the domain's end beyond the last cell's; then there is
      // nothing to refuse.
      check();
      if (block.count > 0) {
        for (int k = 0; k < block.count; ++k) {
          block.s[k] = std::clamp((u[k] - cells.origin_u) * cells.scale_u, 0.0, double(cells.cells_u));
          block.t[k] = std::clamp((v[k] - cells.origin_v) * cells.scale_v, 0.0, double(cells.cells_v));
          const int i = std::min(static_cast<int>(block.s[k]), cells.cells_u - 1);
          const int j = std::min(static_cast<int>(block.t[k]), cells.cells_v - 1);
          block.s[k] -= i, block.t[k] -= j;
          block.cell[k] = i * cells.cells_v + j;
        }
      }
    }
  } else {
    check();
    for (int k = 0; k < block.count; ++k) {
      const auto& [along_u, along_v] = *lookup_;
      const int i = along_u.locate(u[k]), j = along_v.locate(v[k]);
      block.s[k] = along_u.local(i, u[k]), block.t[k] = along_v.local(j, v[k]);
      block.cell[k] = i * grid_.cells_v() + j;
    }
  }
  kernel_->values(block);
  return good;
}

void MomentAccumulator::fold(PointBlock& block) {
  block.weighted = true;
  kernel_->values(block);
  kernel_->fold(block, grid_.cells(), grid_.counts());
}

std::expected<void, Flaw> MomentAccumulator::add(const PointColumns& columns) {
  if (columns.u.size() != columns.size() || columns.v.size() != columns.size() ||
      (!columns.weight.empty() && columns.weight.size() != columns.size()))
    return std::unexpected(Flaw{Error::sizes_differ});
  PointBlock block;
  for (std::size_t first = 0; first < columns.size(); first += PointBlock::capacity) {
    const auto good = read(columns, first, block);
    if (block.count > 0) kernel_->fold(block, grid_.cells(), grid_.counts());
    if (!good) return good;
  }
  return {};
}

}  // namespace moldloft::geometry
