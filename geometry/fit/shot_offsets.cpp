#include "geometry/fit/shot_offsets.hpp"

#include <algorithm>
#include <cmath>

namespace moldloft::geometry {

namespace {

using ConstColumn = Eigen::Map<const Eigen::VectorXd>;

}  // namespace

ShotOffsets::ShotOffsets(int max_shots, int cells_u, int cells_v, std::size_t max_shot_cells,
                         std::size_t max_unknowns)
    : cells_u_(cells_u),
      cells_v_(cells_v),
      slot_of_shot_(max_shots, -1),
      place_of_cell_(static_cast<std::size_t>(cells_u) * cells_v, -1),
      columns_(max_unknowns * max_shots),
      offsets_(max_shots),
      right_(max_shots),
      schur_(max_shots, max_shots) {
  slots_.reserve(max_shots);
  cells_.reserve(max_shot_cells);
}

std::size_t ShotOffsets::bytes() const {
  return slot_of_shot_.capacity() * 4 + place_of_cell_.capacity() * 4 + slots_.capacity() * sizeof(Slot) +
         cells_.capacity() * sizeof(ShotCell) +
         (columns_.capacity() + offsets_.capacity() + right_.capacity() + schur_.size()) * sizeof(double);
}

void ShotOffsets::clear() {
  leave_shot();
  std::fill(slot_of_shot_.begin(), slot_of_shot_.end(), -1);
  slots_.clear(), cells_.clear();
  exact_ = 0;
}

void ShotOffsets::leave_shot() {
  for (auto cell = cells_.rbegin(); cell != cells_.rend() && place_of_cell_[cell->cell] >= 0; ++cell) {
    place_of_cell_[cell->cell] = -1;
  }
  current_shot_ = -1, current_is_exact_ = false;
}

void ShotOffsets::finish_adding() { leave_shot(); }

void ShotOffsets::add(int shot, int cell_u, int cell_v, const BernsteinValues& s, const BernsteinValues& t,
                      double z, double weight) {
  if (shot != current_shot_) {
    leave_shot();
    current_shot_ = shot;
    if (slot_of_shot_[shot] < 0) {
      slot_of_shot_[shot] = static_cast<std::int32_t>(slots_.size());
      slots_.push_back({shot, 0, 0});
    }
  }
  if (current_is_exact_) return;
  const auto slot = static_cast<std::uint32_t>(slot_of_shot_[shot]);
  const std::uint32_t cell = static_cast<std::uint32_t>(cell_u * cells_v_ + cell_v);
  std::int32_t& place = place_of_cell_[cell];
  if (place < 0) {
    if (cells_.size() == cells_.capacity()) {
      // No room: the shot loses its offset, wholly, since half of its sums would be a lie.
      while (!cells_.empty() && cells_.back().slot == slot) {
        place_of_cell_[cells_.back().cell] = -1;
        cells_.pop_back();
      }
      for (ShotCell& earlier : cells_) {
        if (earlier.slot == slot) earlier.moments.fill(0);
      }
      slots_[slot].weight = slots_[slot].height = 0;
      current_is_exact_ = true;
      ++exact_;
      return;
    }
    place = static_cast<std::int32_t>(cells_.size());
    cells_.push_back({cell, slot, {}});
  }
  std::array<double, 16>& moments = cells_[place].moments;
  for (int i = 0; i < 4; ++i) {
    const double row = weight * s.cubic[i];
    for (int j = 0; j < 4; ++j) moments[i * 4 + j] += row * t.cubic[j];
  }
  slots_[slot].weight += weight;
  slots_[slot].height += weight * z;
}

void ShotOffsets::start(int unknowns) {
  unknowns_ = static_cast<std::size_t>(unknowns);
  std::fill_n(offsets_.begin(), slots_.size(), 0.0);
}

void ShotOffsets::scatter(const SplineNet& net, int cells_u, int cells_v, std::size_t first,
                          std::size_t end) {
  const int share_u = cells_u_ / cells_u, share_v = cells_v_ / cells_v;  // fine cells in one of the net's
  for (std::size_t k = first; k < end; ++k) {
    const int i = static_cast<int>(cells_[k].cell) / cells_v_,
              j = static_cast<int>(cells_[k].cell) % cells_v_;
    const double u = i % share_u, v = j % share_v;
    std::array<double, 16> moments{};
    add_restricted<3>(restriction<3>(u / share_u, (u + 1) / share_u),
                      restriction<3>(v / share_v, (v + 1) / share_v), cells_[k].moments, moments);
    net.add_to(column(static_cast<int>(cells_[k].slot)), i / share_u, j / share_v,
               net.load(i / share_u, j / share_v, moments));
  }
}

void ShotOffsets::form(int row, int first, int end, std::span<const double> y) {
  const ConstColumn w(column(row).data(), static_cast<Eigen::Index>(unknowns_));
  for (int t = first; t < end; ++t) {
    schur_(row, t) = (t == row ? slots_[row].weight : 0.0) -
                     w.dot(ConstColumn(column(t).data(), static_cast<Eigen::Index>(unknowns_)));
  }
  if (end == row + 1) {
    right_[row] = slots_[row].height - w.dot(ConstColumn(y.data(), static_cast<Eigen::Index>(unknowns_)));
  }
}

bool ShotOffsets::factor_row(int row, double rho) {
  for (int t = 0; t <= row; ++t) {
    double sum = schur_(row, t) + (t == row ? rho : 0.0);
    for (int k = 0; k < t; ++k) sum -= schur_(row, k) * schur_(t, k);
    if (t < row) {
      schur_(row, t) = sum / schur_(t, t);
    } else {
      if (!(sum > 0)) return false;
      schur_(row, row) = std::sqrt(sum);
    }
  }
  return true;
}

void ShotOffsets::solve() {
  const int n = count();
  for (int i = 0; i < n; ++i) {
    double sum = right_[i];
    for (int k = 0; k < i; ++k) sum -= schur_(i, k) * offsets_[k];
    offsets_[i] = sum / schur_(i, i);
  }
  for (int i = n; i-- > 0;) {
    for (int k = i + 1; k < n; ++k) offsets_[i] -= schur_(k, i) * offsets_[k];
    offsets_[i] /= schur_(i, i);
  }
}

double ShotOffsets::explained() const {
  double sum = 0;
  for (int i = 0; i < count(); ++i) sum += slots_[i].height * offsets_[i];
  return sum;
}

}  // namespace moldloft::geometry
