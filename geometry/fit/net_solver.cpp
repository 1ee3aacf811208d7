#include "geometry/fit/net_solver.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace moldloft::geometry {

namespace {

// A pivot below this share of the largest is rounding, not data.
constexpr double pivot_floor = 1e-15;

// Multiply-adds, about, of the pieces that do not depend on the net's size. What is no vector loop counts by the
// instructions it takes: four or five are as long as a multiply-add of a panel.
constexpr double gram_cost = 2000, load_cost = 220, fairing_cost = 700, touch_cost = 30,
                 unknown_fairing_cost = 130;
constexpr double offset_cost = 1.6;  // of an entry of the shots' columns

// What a step may take at once where the band is so wide that a whole panel would be more.
constexpr double longest_piece = 52'000;

using ConstVector = Eigen::Map<const Eigen::VectorXd>;

}  // namespace

NetSolver::NetSolver(std::size_t max_unknowns, std::size_t max_half_band)
    : matrix_(max_unknowns, max_half_band),
      right_(max_unknowns),
      data_diagonal_(max_unknowns),
      column_sums_(max_unknowns),
      corner_(max_unknowns) {}

std::size_t NetSolver::bytes() const {
  return matrix_.bytes() + (right_.capacity() + data_diagonal_.capacity() + column_sums_.capacity() +
                            corner_.capacity()) *
                               sizeof(double);
}

bool NetSolver::holds(const SplineNet& net) const {
  const auto unknowns = static_cast<std::size_t>(net.unknowns());
  return unknowns <= right_.size() && matrix_.holds(unknowns, static_cast<std::size_t>(net.half_band()));
}

void NetSolver::start(const NetTask& task, ShotOffsets* shots) {
  task_ = task;
  shots_ = task.shot_sigma_mm > 0 && shots != nullptr && shots->count() > 0 ? shots : nullptr;
  assert(shots_ == nullptr || task.boundary.empty());
  assert(task.boundary.empty() || static_cast<int>(task.boundary.size()) == size());
  result_ = {};
  result_.point_sigma_mm = task.point_sigma_mm;
  if (!holds(*task.net)) {
    stage_ = Stage::net_too_large;
    return;
  }
  matrix_.reset(size(), task.net->half_band());
  trace_data_ = objective_ = border_squares_ = norm_one_ = 0;
  cursor_ = column_ = row_ = 0, shot_cell_ = 0;
  stage_ = Stage::clear;
}

template <typename Piece>
bool NetSolver::advance(int end, double cost_of_one, Piece&& piece, int grain) {
  const int room = static_cast<int>(std::min<double>(end, (budget_ - work_) / cost_of_one)) / grain * grain;
  if (room < grain && work_ > 0) {
    full_ = true;
    return false;
  }
  const int to = std::min(end, cursor_ + std::max(grain, room));
  piece(cursor_, to);
  work_ += (to - cursor_) * cost_of_one;
  cursor_ = to;
  if (cursor_ < end) return false;
  cursor_ = 0;
  return true;
}

void NetSolver::add_data(int first, int end) {
  const SplineNet& net = *task_.net;
  for (int k = first; k < end; ++k) {
    const int row = k / task_.moments->cells_v(), j = k % task_.moments->cells_v();
    const CellMoments& moments = task_.moments->cell(row, j);
    const std::uint32_t points = task_.moments->points(row, j);
    result_.empty_cells += points == 0;
    result_.sparse_cells += points > 0 && points < task_.sparse_points;
    if (points == 0) continue;
    const CellMatrix gram = net.gram(row, j, moments);
    trace_data_ += SplineNet::trace(gram);
    net.add_to(matrix_, row, j, gram, 1.0);
    net.add_diagonal_to(data_diagonal_, row, j, gram);
    net.add_to(right_, row, j, net.load(row, j, moments.load));
  }
}

void NetSolver::add_sparse_fairing_row(int row) {
  for (int j = 0; j < task_.moments->cells_v(); ++j) {
    if (task_.moments->points(row, j) >= task_.sparse_points) continue;
    task_.net->add_to(matrix_, row, j, task_.net->fairing(row, j, task_.length_u_mm, task_.length_v_mm),
                      sparse_fairing_);
  }
}

void NetSolver::subtract_sparse_energy(int row) {
  for (int j = 0; j < task_.moments->cells_v(); ++j) {
    if (task_.moments->points(row, j) >= task_.sparse_points) continue;
    const CellMatrix fairing = task_.net->fairing(row, j, task_.length_u_mm, task_.length_v_mm);
    objective_ -= sparse_fairing_ * task_.net->energy(row, j, fairing, right_);
  }
}

bool NetSolver::on_border(int unknown) const {
  const SplineNet& net = *task_.net;
  const int fast = net.v_is_fast() ? net.control_v() : net.control_u();
  const int slow = size() / fast, i = unknown / fast, j = unknown % fast;
  return i == 0 || j == 0 || i == slow - 1 || j == fast - 1;
}

// The ring is taken out of the equations in place, so that the band keeps its shape: its rows and columns
// become those of a diagonal matrix whose solution is the value given.
void NetSolver::add_border() {
  const int n = size(), band = matrix_.half_band();
  const double typical = trace_data_ / n;
  for (int k = 0; k < n; ++k) {
    if (!on_border(k)) continue;
    const double g = task_.boundary[k];
    if (std::isfinite(task_.boundary_weight)) {
      matrix_.entry(k, k) += task_.boundary_weight;
      right_[k] += task_.boundary_weight * g;
      border_squares_ += task_.boundary_weight * g * g;
      continue;
    }
    border_squares_ -= 2 * right_[k] * g;
    const auto eliminate = [&](double& entry, int other) {
      right_[other] -= entry * g;
      entry = 0;
    };
    for (int j = std::max(0, k - band); j < k; ++j) eliminate(matrix_.entry(k, j), j);
    border_squares_ += matrix_.entry(k, k) * g * g;
    for (int i = k + 1; i <= std::min(n - 1, k + band); ++i) eliminate(matrix_.entry(i, k), i);
    matrix_.entry(k, k) = typical;
    right_[k] = typical * g;
    border_squares_ += typical * g * g;  // what y'y will take for it
  }
}

void NetSolver::take_norm(int first, int end) {
  for (int j = first; j < end; ++j) {
    column_sums_[j] += std::abs(matrix_.entry(j, j));
    for (int i = j + 1; i <= std::min(size() - 1, j + matrix_.half_band()); ++i) {
      const double size_of_entry = std::abs(matrix_.entry(i, j));
      column_sums_[j] += size_of_entry, column_sums_[i] += size_of_entry;
    }
  }
}

void NetSolver::estimate_noise(double y_squared) {
  const double typical = trace_data_ / size();
  int determined = 0, given = 0;
  for (int k = 0; k < size(); ++k) {
    determined += data_diagonal_[k] > 1e-9 * typical;
    given += !task_.boundary.empty() && std::isinf(task_.boundary_weight) && on_border(k);
  }
  result_.freedom = std::max(1, determined - given);
  objective_ = task_.totals.squares + border_squares_ - y_squared;
  const double free = std::max(1.0, static_cast<double>(task_.totals.points) - result_.freedom);
  const double sigma = std::sqrt(std::max(objective_, 0.0) / free);
  if (result_.point_sigma_mm <= 0) result_.point_sigma_mm = sigma;
  // Noise-free points would make the offsets' prior vanish against the data; a hundredth of the prior is as
  // good as none.
  const double ratio = std::max(result_.point_sigma_mm / std::max(task_.shot_sigma_mm, 1e-12), 1e-2);
  rho_ = ratio * ratio;
}

void NetSolver::take_offsets() {
  shots_->solve();
  const int n = shots_->count();
  double squares = 0;
  for (int s = 0; s < n; ++s) {
    const double d = shots_->offset(s);
    squares += d * d;
    result_.offset_max_mm = std::max(result_.offset_max_mm, std::abs(d));
  }
  result_.offset_rms_mm = std::sqrt(squares / n);
  // The objective's minimum is z'z - r'c - h'd = z'z - y'(y - W d) - h'd; without the prior's part.
  objective_ = task_.totals.squares - shots_->explained() - rho_ * squares;
  result_.freedom += n;
}

// The minimum of the objective holds the energy of fairing and border; the residual is what is
// left without them.
void NetSolver::finish() {
  if (!task_.boundary.empty() && std::isfinite(task_.boundary_weight)) {
    for (int k = 0; k < size(); ++k) {
      if (on_border(k)) objective_ -= task_.boundary_weight * std::pow(right_[k] - task_.boundary[k], 2);
    }
  }
  result_.squares = std::max(objective_, 0.0);
}

template <typename Piece>
bool NetSolver::each_shot(double cost_of_cell, Piece&& piece) {
  while (cursor_ < shots_->count()) {
    const std::size_t all = shots_->cells_of(cursor_);
    const auto room = static_cast<std::size_t>(std::max(0.0, budget_ - work_) / cost_of_cell);
    const std::size_t end = std::min(all, shot_cell_ + room);
    full_ = end < all;
    if (end == shot_cell_ && full_) return false;
    piece(cursor_, shot_cell_, end);
    work_ += 30 + cost_of_cell * static_cast<double>(end - shot_cell_);
    shot_cell_ = end;
    if (end < all) return false;
    ++cursor_, shot_cell_ = 0;
  }
  cursor_ = 0;
  return true;
}

bool NetSolver::step_shots() {
  const int n = size();
  const double band = task_.net->half_band();
  ShotOffsets& shots = *shots_;
  switch (stage_) {
    case Stage::touch:
      if (each_shot(touch_cost, [&](int slot, std::size_t first, std::size_t end) {
            shots.touch(slot, *task_.net, first, end);
          })) {
        shots.start(*task_.net);
        stage_ = Stage::columns;
      }
      return true;
    case Stage::columns:
      if (advance(n, shots.row_length(), [&](int a, int b) {
            shots.clear_rows(a, b);
            for (; a < b; ++a) shots.set_y(a, right_[a]);
          })) {
        stage_ = Stage::scatter;
      }
      return true;
    case Stage::scatter:
      if (each_shot(load_cost, [&](int slot, std::size_t first, std::size_t end) {
            shots.scatter(slot, *task_.net, first, end);
          })) {
        stage_ = Stage::lower, column_ = 0, cursor_ = shots.first_row(0);
      }
      return true;
    case Stage::lower:
      if (advance(
              n, 8 * band,
              [&](int a, int b) {
                matrix_.solve_lower_many(shots.columns(), shots.row_length(), 8 * column_, 8, a, b);
              },
              band_panel)) {
        if (++column_ == shots.groups()) {
          stage_ = Stage::form, column_ = row_ = 0;
        }
        cursor_ = shots.first_row(column_ % shots.groups());
      }
      return true;
    case Stage::form:
      if (advance(n, 64, [&](int a, int b) { shots.form(matrix_.kernel(), row_, column_, a, b); })) {
        if (++column_ > row_) ++row_, column_ = 0;
        if (row_ < shots.groups()) {
          cursor_ = shots.first_row(row_);
        } else {
          estimate_noise(shots.y_squared());
          stage_ = Stage::schur, column_ = 0;
        }
      }
      return true;
    case Stage::schur:
      if (!shots.factor_row(column_, rho_)) return false;
      work_ += 0.6 * column_ * column_ + 60 * column_;
      if (++column_ == shots.count()) {
        take_offsets();
        work_ += 2.4 * column_ * column_;
        stage_ = Stage::offsets, column_ = 0;
      }
      return true;
    default:
      // y - W d, and on the way y'(y - W d), in slices of rows.
      if (advance(n, offset_cost * shots.row_length(), [&](int a, int b) {
            double before_after = 0;
            for (int i = a; i < b; ++i) {
              right_[i] = shots.moved(i);
              before_after += shots.y(i) * right_[i];
            }
            objective_ -= before_after;
          })) {
        stage_ = Stage::backward;
      }
      return true;
  }
}

int NetSolver::corner_unknown(int corner) const {
  const SplineNet& net = *task_.net;
  return net.index(corner == 1 || corner == 2 ? net.control_u() - 1 : 0,
                   corner >= 2 ? net.control_v() - 1 : 0);
}

// The variance of a coefficient is the diagonal entry of the inverse: the square of L^-1 e, which begins at e's own
// row. True when all four are done.
bool NetSolver::step_corners() {
  const int n = size(), unknown = corner_unknown(column_);
  if (cursor_ == 0) {
    std::fill(corner_.begin(), corner_.begin() + n, 0.0);
    corner_[static_cast<std::size_t>(unknown)] = 1;
    cursor_ = unknown;
  }
  if (!advance(n, task_.net->half_band(), [&](int a, int b) { matrix_.solve_lower(corner_, a, b); })) return false;
  result_.corner_sigma_mm[static_cast<std::size_t>(column_)] =
      result_.point_sigma_mm * ConstVector(corner_.data(), n).norm();
  if (++column_ < 4) return false;
  column_ = 0;
  return true;
}

std::expected<bool, Error> NetSolver::step(double budget) {
  work_ = 0, budget_ = budget, full_ = false;
  // The stages of a small net are far shorter than a step: it takes as many as fit.
  while (true) {
    const auto ready = piece();
    if (!ready || *ready || full_ || work_ >= budget_) return ready;
  }
}

std::expected<bool, Error> NetSolver::piece() {
  const SplineNet& net = *task_.net;
  const int n = size(), rows = task_.moments->cells_u(), cells = task_.moments->cells_v();
  const double band = net.half_band();
  switch (stage_) {
    case Stage::clear:
      if (advance(n, band + 3, [&](int a, int b) {
            matrix_.clear(a, b);
            std::fill(right_.begin() + a, right_.begin() + b, 0.0);
            std::fill(data_diagonal_.begin() + a, data_diagonal_.begin() + b, 0.0);
            std::fill(column_sums_.begin() + a, column_sums_.begin() + b, 0.0);
          })) {
        stage_ = Stage::data;
      }
      return false;
    case Stage::data:
      if (advance(task_.moments->cell_count(), gram_cost, [&](int a, int b) { add_data(a, b); })) {
        const double ratio = trace_data_ / net.fairing_trace(task_.length_u_mm, task_.length_v_mm);
        fairing_ = task_.fairing * ratio, sparse_fairing_ = task_.sparse_fairing * ratio;
        stage_ = Stage::fair;
      }
      return false;
    case Stage::fair:
      if (fairing_ <= 0 ||
          advance(net.slow_rows(), unknown_fairing_cost * n / net.slow_rows(), [&](int a, int b) {
            net.add_fairing(matrix_, a, b, task_.length_u_mm, task_.length_v_mm, fairing_);
          })) {
        stage_ = Stage::border;
      }
      return false;
    case Stage::border:
      if (sparse_fairing_ <= 0 || advance(rows, fairing_cost * cells, [&](int a, int b) {
            for (; a < b; ++a) add_sparse_fairing_row(a);
          })) {
        if (!task_.boundary.empty()) add_border(), work_ += 2 * band * 4 * std::sqrt(n);
        stage_ = norm_wanted_ ? Stage::norm : Stage::factor;
      }
      return false;
    case Stage::norm:
      if (advance(n, 2 * band, [&](int a, int b) { take_norm(a, b); })) {
        norm_one_ = *std::max_element(column_sums_.begin(), column_sums_.begin() + n);
        stage_ = Stage::factor;
      }
      return false;
    case Stage::factor: {
      bool positive = true;
      const double column_cost = 0.5 * band * (band + 8);
      // Narrower panels give the same numbers, only less quickly.
      const int panel =
          static_cast<int>(std::clamp(std::max(budget_, longest_piece) / column_cost, 1.0, 1.0 * band_panel));
      const bool finished = advance(
          n, column_cost, [&](int a, int b) { positive = matrix_.factor(a, b); }, panel);
      if (!positive) return std::unexpected(Error::singular);
      if (!finished) return false;
      result_.smallest_pivot = matrix_.smallest_pivot() / matrix_.largest_pivot();
      result_.smallest_pivot_unknown = matrix_.smallest_column();
      if (!(result_.smallest_pivot > pivot_floor)) return std::unexpected(Error::singular);
      stage_ = shots_ ? Stage::touch : Stage::forward;
      return false;
    }
    case Stage::forward:
      if (advance(n, band, [&](int a, int b) { matrix_.solve_lower(right_, a, b); })) {
        estimate_noise(ConstVector(right_.data(), n).squaredNorm());
        stage_ = Stage::backward;
      }
      return false;
    case Stage::touch:
    case Stage::columns:
    case Stage::scatter:
    case Stage::lower:
    case Stage::form:
    case Stage::schur:
    case Stage::offsets:
      if (!step_shots()) return std::unexpected(Error::singular);
      return false;
    case Stage::backward:
      if (advance(n, band, [&](int a, int b) { matrix_.solve_upper(right_, n - b, n - a); }))
        stage_ = task_.boundary.empty() ? Stage::corners : Stage::energy;
      return false;
    case Stage::corners:
      if (step_corners()) stage_ = Stage::energy, cursor_ = 0;
      return false;
    case Stage::energy:
      if (fairing_ <= 0 ||
          advance(net.slow_rows(), unknown_fairing_cost * n / net.slow_rows(), [&](int a, int b) {
            objective_ -=
                fairing_ * net.fairing_energy(coefficients(), a, b, task_.length_u_mm, task_.length_v_mm);
          })) {
        stage_ = Stage::sparse_energy;
      }
      return false;
    case Stage::sparse_energy:
      if (sparse_fairing_ <= 0 || advance(rows, fairing_cost * cells, [&](int a, int b) {
            for (; a < b; ++a) subtract_sparse_energy(a);
          })) {
        finish();
        if (!std::isfinite(result_.squares)) return std::unexpected(Error::too_large);
        stage_ = Stage::done;
        return true;
      }
      return false;
    case Stage::done:
      return true;
    case Stage::net_too_large:
      return std::unexpected(Error::capacity);
  }
  return true;
}

std::expected<void, Error> NetSolver::solve() {
  while (true) {
    const auto ready = step(std::numeric_limits<double>::max());
    if (!ready) return std::unexpected(ready.error());
    if (*ready) return {};
  }
}

double NetSolver::progress() const { return static_cast<double>(stage_) / static_cast<double>(Stage::done); }

}  // namespace moldloft::geometry
