#include "geometry/inspection/least_distance.hpp"

#include <Eigen/QR>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>

namespace moldloft::geometry {

namespace {

constexpr int most_exchanges = 400;
constexpr double relative_accuracy = 1e-12;

using Column = Eigen::Matrix<double, 7, 1>;
using Columns = Eigen::Matrix<double, 7, Eigen::Dynamic, Eigen::ColMajor, 7, 7>;
using Shares = Eigen::Matrix<double, Eigen::Dynamic, 1, Eigen::ColMajor, 7, 1>;

// The columns with a positive share, and their shares.
struct PassiveSet {
  std::array<std::size_t, 7> row{};
  Columns columns = Columns(7, 0);
  Shares share = Shares(0);

  int size() const { return static_cast<int>(columns.cols()); }
  void add(std::size_t index, const Column& column) {
    row[static_cast<std::size_t>(size())] = index;
    columns.conservativeResize(7, size() + 1);
    columns.col(size() - 1) = column;
    share.conservativeResize(size());
    share[size() - 1] = 0;
  }
  void remove(int at) {
    for (int k = at; k + 1 < size(); ++k) {
      row[static_cast<std::size_t>(k)] = row[static_cast<std::size_t>(k) + 1];
      columns.col(k) = columns.col(k + 1).eval();
      share[k] = share[k + 1];
    }
    columns.conservativeResize(7, size() - 1);
    share.conservativeResize(size());
  }
};

}  // namespace

std::optional<LeastDistance> least_distance(std::span<const std::array<double, 6>> rows,
                                            std::span<const double> bounds,
                                            std::span<const std::uint8_t> open) {
  assert(rows.size() == bounds.size() && (open.empty() || open.size() == rows.size()));
  const auto takes_part = [&](std::size_t i) { return open.empty() || open[i] != 0; };
  double scale = 0;
  for (std::size_t i = 0; i < bounds.size(); ++i) {
    if (takes_part(i)) scale = std::max(scale, std::abs(bounds[i]));
  }
  if (scale == 0) return LeastDistance{};

  // The last entry of the residual of the dual is -1 / (1 + |z|^2) in units of `unit`: with z of the order of
  // 1 the division by it loses nothing.
  const double unit = scale;
  const auto column_of = [&](std::size_t i) {
    Column column;
    for (int k = 0; k < 6; ++k) column[k] = rows[i][static_cast<std::size_t>(k)];
    column[6] = bounds[i] / unit;
    return column;
  };
  Column target = Column::Zero();
  target[6] = 1;
  PassiveSet set;
  Column residual = -target;
  std::size_t refused = rows.size();
  for (int exchange = 0; exchange < most_exchanges; ++exchange) {
    if (residual.norm() < 1e-10)
      return std::nullopt;  // the constraints reach the target: nothing satisfies them
    // The most broken constraint at z = -residual / residual[6].
    Vector6 z = -residual.head<6>() / residual[6];
    std::size_t worst = rows.size();
    double most = relative_accuracy * std::max(1.0, z.norm());
    for (std::size_t i = 0; i < rows.size(); ++i) {
      const auto& g = rows[i];
      const double broken = bounds[i] / unit - (g[0] * z[0] + g[1] * z[1] + g[2] * z[2] + g[3] * z[3] +
                                                g[4] * z[4] + g[5] * z[5]);
      if (broken > most && i != refused && takes_part(i) &&
          std::find(set.row.begin(), set.row.begin() + set.size(), i) == set.row.begin() + set.size())
        most = broken, worst = i;
    }
    if (worst == rows.size()) {
      LeastDistance answer;
      answer.z = unit * z;
      answer.active_count = set.size();
      for (int k = 0; k < set.size(); ++k) {
        answer.active[static_cast<std::size_t>(k)] = {set.row[static_cast<std::size_t>(k)],
                                                      unit * set.share[k] / -residual[6]};
      }
      return answer;
    }
    if (set.size() == 7) return std::nullopt;  // seven that do not depend on each other reach any target
    set.add(worst, column_of(worst));
    for (;;) {
      const Shares wanted = set.columns.colPivHouseholderQr().solve(target);
      if (wanted.minCoeff() > 0) {
        set.share = wanted;
        refused = rows.size();
        break;
      }
      // As far towards `wanted` as all shares stay nonnegative; those that reach zero leave.
      double reach = 1;
      for (int k = 0; k < set.size(); ++k) {
        if (wanted[k] <= 0) reach = std::min(reach, set.share[k] / (set.share[k] - wanted[k]));
      }
      if (!std::isfinite(reach)) reach = 0;
      for (int k = set.size() - 1; k >= 0; --k) {
        const double share = set.share[k] + reach * (wanted[k] - set.share[k]);
        set.share[k] = share;
        if (wanted[k] <= 0 && share <= 1e-15) {
          // The one that has just come and leaves at once would come again for ever.
          if (set.row[static_cast<std::size_t>(k)] == worst) refused = worst;
          set.remove(k);
        }
      }
      if (set.size() == 0) break;
    }
    residual = -target;
    for (int k = 0; k < set.size(); ++k) residual += set.share[k] * set.columns.col(k);
  }
  return std::nullopt;
}

}  // namespace moldloft::geometry
