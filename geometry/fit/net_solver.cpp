#include "geometry/fit/net_solver.hpp"

#include <algorithm>
#include <cmath>

namespace moldloft::geometry {

namespace {

constexpr double work_a_piece = 150'000;  // multiply-adds: some 100 us on the slowest machine that we know

// A pivot below this share of the largest is rounding, not data.
constexpr double pivot_floor = 1e-15;

using ConstVector = Eigen::Map<const Eigen::VectorXd>;

}  // namespace

NetSolver::NetSolver(std::size_t max_unknowns, std::size_t max_half_band)
    : matrix_(max_unknowns, max_half_band), right_(max_unknowns), data_diagonal_(max_unknowns) {}

std::size_t NetSolver::bytes() const {
  return matrix_.bytes() + (right_.capacity() + data_diagonal_.capacity()) * sizeof(double);
}

void NetSolver::start(const NetTask& task, ShotOffsets* shots) {
  task_ = task;
  shots_ = task.shot_sigma_mm > 0 && shots != nullptr && shots->count() > 0 ? shots : nullptr;
  result_ = {};
  result_.point_sigma_mm = task.point_sigma_mm;
  matrix_.reset(size(), task.net->half_band());
  trace_data_ = trace_fairing_ = 0;
  cursor_ = column_ = 0;
  phase_ = Phase::clear;
}

int NetSolver::slice(double cost_of_one) const {
  return std::max(1, static_cast<int>(work_a_piece / cost_of_one));
}

template <typename Piece>
bool NetSolver::advance(int end, double cost_of_one, Piece&& piece) {
  const int to = std::min(end, cursor_ + slice(cost_of_one));
  piece(cursor_, to);
  cursor_ = to;
  if (cursor_ < end) return false;
  cursor_ = 0;
  return true;
}

void NetSolver::add_data_row(int row) {
  const SplineNet& net = *task_.net;
  for (int j = 0; j < task_.moments->cells_v(); ++j) {
    const CellMoments& moments = task_.moments->cell(row, j);
    const CellMatrix fairing = net.fairing(row, j, task_.length_u_mm, task_.length_v_mm);
    for (int k = 0; k < 16; ++k) trace_fairing_ += fairing[k][k];
    if (!(moments.weight() > 0)) {
      ++result_.empty_cells;
      continue;
    }
    const CellMatrix gram = net.gram(row, j, moments);
    CellVector diagonal;
    for (int k = 0; k < 16; ++k) trace_data_ += diagonal[k] = gram[k][k];
    net.add_to(matrix_, row, j, gram, 1.0);
    net.add_to(data_diagonal_, row, j, diagonal);
    net.add_to(right_, row, j, net.load(row, j, moments.load));
  }
}

void NetSolver::add_fairing_row(int row) {
  for (int j = 0; j < task_.moments->cells_v(); ++j) {
    task_.net->add_to(matrix_, row, j, task_.net->fairing(row, j, task_.length_u_mm, task_.length_v_mm),
                      fairing_);
  }
}

// The minimum of the objective holds the fairing's energy; the residual is what is left without it.
void NetSolver::subtract_fairing_energy(int row) {
  for (int j = 0; j < task_.moments->cells_v(); ++j) {
    const CellMatrix fairing = task_.net->fairing(row, j, task_.length_u_mm, task_.length_v_mm);
    const CellVector c = task_.net->gather(right_, row, j);
    double energy = 0;
    for (int k = 0; k < 16; ++k) {
      for (int l = 0; l < 16; ++l) energy += c[k] * fairing[k][l] * c[l];
    }
    objective_ -= fairing_ * energy;
  }
}

void NetSolver::estimate_noise() {
  const double typical = trace_data_ / size();
  result_.freedom = static_cast<double>(std::count_if(data_diagonal_.begin(), data_diagonal_.begin() + size(),
                                                      [&](double d) { return d > 1e-9 * typical; }));
  objective_ = task_.totals.squares - ConstVector(right_.data(), size()).squaredNorm();
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

std::expected<bool, Error> NetSolver::step() {
  const int n = size(), rows = task_.moments->cells_u(), cells = task_.moments->cells_v();
  const double band = task_.net->half_band();
  switch (phase_) {
    case Phase::clear:
      if (advance(n, band + 3, [&](int a, int b) {
            matrix_.clear(a, b);
            std::fill(right_.begin() + a, right_.begin() + b, 0.0);
            std::fill(data_diagonal_.begin() + a, data_diagonal_.begin() + b, 0.0);
          })) {
        phase_ = Phase::data;
      }
      return false;
    case Phase::data:
      if (advance(rows, 4000.0 * cells, [&](int a, int b) {
            for (; a < b; ++a) add_data_row(a);
          })) {
        fairing_ = task_.fairing * trace_data_ / trace_fairing_;
        phase_ = Phase::fair;
      }
      return false;
    case Phase::fair:
      if (advance(rows, 3000.0 * cells, [&](int a, int b) {
            for (; a < b; ++a) add_fairing_row(a);
          })) {
        phase_ = Phase::factor;
      }
      return false;
    case Phase::factor: {
      bool positive = true;
      const bool finished =
          advance(n, 0.5 * band * band, [&](int a, int b) { positive = matrix_.factor(a, b); });
      if (!positive) return std::unexpected(Error::singular);
      if (!finished) return false;
      result_.smallest_pivot = matrix_.smallest_pivot() / matrix_.largest_pivot();
      if (!(result_.smallest_pivot > pivot_floor)) return std::unexpected(Error::singular);
      phase_ = Phase::forward;
      return false;
    }
    case Phase::forward:
      if (advance(n, band, [&](int a, int b) { matrix_.solve_lower(right_, a, b); })) {
        estimate_noise();
        phase_ = shots_ ? Phase::columns : Phase::backward;
        if (shots_) shots_->start(n);
      }
      return false;
    case Phase::columns:
      if (advance(shots_->count(), n, [&](int a, int b) {
            for (; a < b; ++a) std::ranges::fill(shots_->column(a), 0.0);
          })) {
        phase_ = Phase::scatter;
      }
      return false;
    case Phase::scatter:
      if (advance(static_cast<int>(shots_->shot_cells()), 1000,
                  [&](int a, int b) { shots_->scatter(*task_.net, rows, cells, a, b); })) {
        phase_ = Phase::lower, column_ = 0;
      }
      return false;
    case Phase::lower:
      if (advance(n, band, [&](int a, int b) { matrix_.solve_lower(shots_->column(column_), a, b); }) &&
          ++column_ == shots_->count()) {
        phase_ = Phase::form, column_ = 0;
      }
      return false;
    case Phase::form:
      if (advance(column_ + 1, n, [&](int a, int b) { shots_->form(column_, a, b, right_); }) &&
          ++column_ == shots_->count()) {
        phase_ = Phase::schur, column_ = 0;
      }
      return false;
    case Phase::schur:
      if (!shots_->factor_row(column_, rho_)) return std::unexpected(Error::singular);
      if (++column_ == shots_->count()) {
        take_offsets();
        phase_ = Phase::offsets, column_ = 0;
      }
      return false;
    case Phase::offsets: {
      // y - W d, and on the way y'(y - W d), in slices of rows.
      if (advance(n, shots_->count(), [&](int a, int b) {
            double before_after = 0;
            for (int i = a; i < b; ++i) {
              double moved = right_[i];
              for (int s = 0; s < shots_->count(); ++s) moved -= shots_->column(s)[i] * shots_->offset(s);
              before_after += right_[i] * moved;
              right_[i] = moved;
            }
            objective_ -= before_after;
          })) {
        phase_ = Phase::backward;
      }
      return false;
    }
    case Phase::backward:
      if (advance(n, band, [&](int a, int b) { matrix_.solve_upper(right_, n - b, n - a); }))
        phase_ = Phase::energy;
      return false;
    case Phase::energy:
      if (advance(rows, 3000.0 * cells, [&](int a, int b) {
            for (; a < b; ++a) subtract_fairing_energy(a);
          })) {
        result_.squares = std::max(objective_, 0.0);
        phase_ = Phase::done;
        return true;
      }
      return false;
    case Phase::done:
      return true;
  }
  return true;
}

double NetSolver::progress() const { return static_cast<double>(phase_) / static_cast<double>(Phase::done); }

}  // namespace moldloft::geometry
