#include "geometry/fit/shot_offsets.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace moldloft::geometry {

namespace {

int columns_for(int shots) { return (shots + 1 + 7) / 8 * 8; }  // y and the shots, in groups of eight

int blocks_for(int shots) {
  const int groups = columns_for(shots) / 8;
  return groups * (groups + 1) / 2;
}

}  // namespace

ShotOffsets::ShotOffsets(int max_shots, int cells_u, int cells_v, std::size_t max_shot_cells,
                         std::size_t max_unknowns)
    : level_u_(cells_u),
      level_v_(cells_v),
      slot_of_shot_(max_shots, -1),
      place_of_cell_(static_cast<std::size_t>(cells_u) * cells_v, -1),
      columns_(max_unknowns * columns_for(max_shots)),
      blocks_(max_unknowns > 0 ? 64 * blocks_for(max_shots) : 0),
      offsets_(max_shots),
      right_(max_shots),
      coupled_(columns_for(max_shots)),
      schur_(max_shots, max_shots) {
  slots_.reserve(max_shots);
  cells_.reserve(max_shot_cells);
  order_.reserve(max_shots);
  first_row_.reserve(columns_for(max_shots) / 8);
}

std::size_t ShotOffsets::bytes() const {
  return (slot_of_shot_.capacity() + place_of_cell_.capacity() + order_.capacity() + first_row_.capacity()) *
             4 +
         slots_.capacity() * sizeof(Slot) + cells_.capacity() * sizeof(ShotCell) +
         (columns_.capacity() + blocks_.capacity() + offsets_.capacity() + right_.capacity() +
          coupled_.capacity() + schur_.size()) *
             sizeof(double);
}

void ShotOffsets::clear(int cells_u, int cells_v) {
  assert(static_cast<std::size_t>(cells_u) * cells_v <= place_of_cell_.size());
  leave_shot();
  std::fill(slot_of_shot_.begin(), slot_of_shot_.end(), -1);
  slots_.clear(), cells_.clear();
  exact_ = 0;
  level_u_ = cells_u, level_v_ = cells_v;
}

void ShotOffsets::leave_shot() {
  if (current_slot_ >= 0) {
    for (std::size_t k = slots_[current_slot_].begin; k < cells_.size(); ++k)
      place_of_cell_[cells_[k].cell] = -1;
  }
  current_slot_ = -1, current_is_exact_ = false;
}

void ShotOffsets::finish_adding() { leave_shot(); }

// No room: the shot loses its offset, wholly, since half of its sums would be a lie.
void ShotOffsets::give_up(Slot& slot) {
  for (std::size_t k = slot.begin; k < cells_.size(); ++k) place_of_cell_[cells_[k].cell] = -1;
  cells_.resize(slot.begin);
  slot.end = slot.begin, slot.height = 0;
  current_is_exact_ = true;
  ++exact_;
}

std::int32_t ShotOffsets::place_of(std::int32_t cell) {
  std::int32_t& place = place_of_cell_[cell];
  if (place < 0 && cells_.size() < cells_.capacity()) {
    place = static_cast<std::int32_t>(cells_.size());
    cells_.push_back({cell, {}});
  }
  return place;
}

void ShotOffsets::add(int shot, const PointBlock& block) {
  if (current_slot_ < 0 || slots_[current_slot_].shot != shot) {
    leave_shot();
    current_slot_ = slot_of_shot_[shot];
    if (current_slot_ < 0) {
      current_slot_ = slot_of_shot_[shot] = count();
      slots_.push_back({shot, cells_.size(), cells_.size(), 0});
    } else {  // come back to: its cells are closed, and what is new is taken as exact
      current_is_exact_ = true;
      return;
    }
  }
  if (current_is_exact_) return;
  Slot& slot = slots_[current_slot_];
  const MomentKernel& kernel = moment_kernel();
  for (int first = 0, end; first < block.count; first = end) {
    const std::int32_t cell = block.cell[first];
    for (end = first + 1; end < block.count && block.cell[end] == cell;) ++end;
    const std::int32_t place = place_of(cell);
    if (place < 0) return give_up(slot);
    kernel.fold_shot(block, first, end, cells_[place].moments.data());
  }
  slot.end = cells_.size();
  double height = 0;
  for (int k = 0; k < block.count; ++k)
    height += block.weighted ? block.weight[k] * block.height[k] : block.height[k];
  slot.height += height;
}

void ShotOffsets::coarsen(int slot, const MomentGrid& to, std::size_t first, std::size_t end) {
  const int halves_u = level_u_ / to.cells_u(), halves_v = level_v_ / to.cells_v();
  static constexpr std::array<std::array<std::array<double, 4>, 4>, 3> part{
      restriction<3>(0, 0.5), restriction<3>(0.5, 1), restriction<3>(0, 1)};
  Slot& s = slots_[slot];
  if (first == 0) kept_ = s.begin;
  for (std::size_t k = s.begin + first; k < s.begin + end; ++k) {
    const ShotCell fine = cells_[k];
    const int i = fine.cell / level_v_, j = fine.cell % level_v_;
    const std::int32_t cell = i / halves_u * to.cells_v() + j / halves_v;
    std::int32_t& place = place_of_cell_[cell];
    if (place < 0) {  // kept_ <= k: a merged cell never lies behind those that are still to be read
      place = static_cast<std::int32_t>(kept_);
      cells_[kept_++] = {cell, {}};
    }
    add_restricted<3>(part[halves_u == 2 ? i % 2 : 2], part[halves_v == 2 ? j % 2 : 2], fine.moments,
                      cells_[place].moments);
  }
  if (s.begin + end < s.end) return;
  s.end = kept_;
  for (std::size_t k = s.begin; k < s.end; ++k) place_of_cell_[cells_[k].cell] = -1;
}

void ShotOffsets::touch(int slot, const SplineNet& net, std::size_t first, std::size_t end) {
  Slot& s = slots_[slot];
  if (first == 0) s.first_row = net.unknowns(), s.weight = 0;
  for (std::size_t k = s.begin + first; k < s.begin + end; ++k) {
    s.first_row =
        std::min(s.first_row, net.first_index(cells_[k].cell / level_v_, cells_[k].cell % level_v_));
    for (const double m : cells_[k].moments) s.weight += m;  // the cubics sum to one
  }
}

void ShotOffsets::start(const SplineNet& net) {
  unknowns_ = static_cast<std::size_t>(net.unknowns());
  row_length_ = columns_for(count());
  order_.resize(slots_.size());
  for (int slot = 0; slot < count(); ++slot) order_[slot] = slot;
  std::sort(order_.begin(), order_.end(), [this](int a, int b) {
    return std::pair(slots_[a].first_row, a) < std::pair(slots_[b].first_row, b);
  });
  first_row_.assign(groups(), 0);  // y is in the first group and begins with the first row
  for (int k = 0; k < count(); ++k) {
    slots_[order_[k]].column = k + 1;
    if ((k + 1) % 8 == 0) first_row_[(k + 1) / 8] = slots_[order_[k]].first_row / band_panel * band_panel;
  }
  std::fill_n(blocks_.begin(), 64 * blocks_for(count()), 0.0);
}

void ShotOffsets::clear_rows(int first, int end) {
  std::fill(columns_.begin() + static_cast<std::ptrdiff_t>(first) * row_length_,
            columns_.begin() + static_cast<std::ptrdiff_t>(end) * row_length_, 0.0);
}

void ShotOffsets::scatter(int slot, const SplineNet& net, std::size_t first, std::size_t end) {
  const Slot& s = slots_[slot];
  for (std::size_t k = s.begin + first; k < s.begin + end; ++k) {
    const int i = cells_[k].cell / level_v_, j = cells_[k].cell % level_v_;
    net.add_to(columns().subspan(s.column), i, j, net.load(i, j, cells_[k].moments), row_length_);
  }
}

void ShotOffsets::form(const BandKernel& kernel, int group_a, int group_b, int first, int end) {
  kernel.gram_block(columns_.data(), row_length_, first, end, 8 * group_a, 8 * group_b,
                    &blocks_[64 * (group_a * (group_a + 1) / 2 + group_b)]);
}

double ShotOffsets::gram(int a, int b) const {
  if (a < b) std::swap(a, b);
  return blocks_[64 * (a / 8 * (a / 8 + 1) / 2 + b / 8) + 8 * (a % 8) + b % 8];
}

bool ShotOffsets::factor_row(int row, double rho) {
  const Slot& s = slots_[row];
  for (int t = 0; t <= row; ++t) {
    double sum = (t == row ? s.weight + rho : 0.0) - gram(s.column, slots_[t].column);
    for (int k = 0; k < t; ++k) sum -= schur_(row, k) * schur_(t, k);
    if (t < row) {
      schur_(row, t) = sum / schur_(t, t);
    } else {
      if (!(sum > 0)) return false;
      schur_(row, row) = std::sqrt(sum);
    }
  }
  right_[row] = s.height - gram(s.column, 0);
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
  std::fill(coupled_.begin(), coupled_.end(), 0.0);
  coupled_[0] = 1;
  for (int i = 0; i < n; ++i) coupled_[slots_[i].column] = -offsets_[i];
}

double ShotOffsets::moved(int row) const {
  const double* const at = &columns_[static_cast<std::size_t>(row) * row_length_];
  double sum = 0;
  for (int c = 0; c < row_length_; ++c) sum += at[c] * coupled_[c];
  return sum;
}

double ShotOffsets::explained() const {
  double sum = 0;
  for (int i = 0; i < count(); ++i) sum += slots_[i].height * offsets_[i];
  return sum;
}

}  // namespace moldloft::geometry
