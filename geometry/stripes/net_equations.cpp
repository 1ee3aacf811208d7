#include "geometry/stripes/net_equations.hpp"

#include "geometry/splines/gauss_nodes.hpp"

#include <algorithm>
#include <cassert>

namespace moldloft::geometry {

namespace {

int half_band_of(int free_u, int free_v, int block) { return block * (3 * std::min(free_u, free_v) + 4) - 1; }

}  // namespace

LiveBasis live_basis(const BSplineSurface& surface, const Eigen::Vector2d& uv) {
  const int ku = find_span(surface.knots_u, uv.x()), kv = find_span(surface.knots_v, uv.y());
  return {ku - cubic, kv - cubic, cubic_basis(surface.knots_u, ku, uv.x()).value,
          cubic_basis(surface.knots_v, kv, uv.y()).value};
}

NetEquations::NetEquations(const std::vector<double>& knots_u, const std::vector<double>& knots_v,
                           bool keep_border, int block)
    : border_(keep_border ? 1 : 0),
      control_u_(static_cast<int>(knots_u.size()) - cubic - 1),
      control_v_(static_cast<int>(knots_v.size()) - cubic - 1),
      free_u_(control_u_ - 2 * border_),
      free_v_(control_v_ - 2 * border_),
      block_(block),
      rough_u_(roughness(knots_u)),
      rough_v_(roughness(knots_v)),
      matrix_(static_cast<std::size_t>(block) * free_u_ * free_v_,
              static_cast<std::size_t>(half_band_of(free_u_, free_v_, block))),
      right_(3u * free_u_ * free_v_) {
  assert((block == 1 || block == 3) && free_u_ > 0 && free_v_ > 0);
  clear();
}

std::vector<NetEquations::SpanRoughness> NetEquations::roughness(const std::vector<double>& knots) {
  std::vector<SpanRoughness> all(knots.size() - 2 * cubic - 1);
  for (std::size_t s = 0; s < all.size(); ++s) {
    const std::size_t k = s + cubic;
    const double h = knots[k + 1] - knots[k];
    for (auto& order : all[s]) order.setZero();
    if (!(h > 0)) continue;
    for (int g = 0; g < 4; ++g) {
      const BasisValues basis = cubic_basis(knots, static_cast<int>(k), knots[k] + gauss_node[g] * h);
      const Eigen::Map<const Eigen::Vector4d> value(basis.value.data()), first(basis.first.data()),
          second(basis.second.data());
      all[s][0] += h * gauss_weight[g] * value * value.transpose();
      all[s][1] += h * gauss_weight[g] * first * first.transpose();
      all[s][2] += h * gauss_weight[g] * second * second.transpose();
    }
  }
  return all;
}

int NetEquations::place(int i, int j) const {
  const int a = i - border_, b = j - border_;
  if (a < 0 || b < 0 || a >= free_u_ || b >= free_v_) return -1;
  return free_v_ <= free_u_ ? a * free_v_ + b : b * free_u_ + a;  // the shorter direction runs fastest
}

void NetEquations::clear() {
  const int size = block_ * unknowns();
  matrix_.reset(size, std::min(size - 1, half_band_of(free_u_, free_v_, block_)));
  matrix_.clear(0, size);
  std::ranges::fill(right_, 0.0);
  trace_ = 0;
}

void NetEquations::add(const LiveBasis& basis, const Eigen::Matrix3d& weight, const Eigen::Vector3d& load) {
  std::array<int, 16> at;
  std::array<double, 16> value;
  for (int a = 0; a < 4; ++a) {
    for (int b = 0; b < 4; ++b) {
      at[a * 4 + b] = place(basis.first_u + a, basis.first_v + b);
      value[a * 4 + b] = basis.u[a] * basis.v[b];
    }
  }
  const int all = unknowns();
  for (int k = 0; k < 16; ++k) {
    if (at[k] < 0) continue;
    for (int axis = 0; axis < 3; ++axis)
      right_[block_ == 3 ? at[k] * 3 + axis : axis * all + at[k]] -= value[k] * load[axis];
    trace_ += value[k] * value[k] * weight.trace() / 3;
    for (int l = 0; l < 16; ++l) {
      if (at[l] < 0 || at[l] > at[k]) continue;
      const double product = value[k] * value[l];
      if (block_ == 1) {
        matrix_.entry(at[k], at[l]) += product * weight(0, 0);
      } else {
        for (int p = 0; p < 3; ++p) {
          for (int q = 0; q < (at[k] == at[l] ? p + 1 : 3); ++q)
            matrix_.entry(at[k] * 3 + p, at[l] * 3 + q) += product * weight(p, q);
        }
      }
    }
  }
}

template <typename Visit>
void NetEquations::for_each_energy_cell(double length_u, double length_v, const Visit& visit) const {
  // f_xx^2 + 2 f_xy^2 + f_yy^2 with x = length_u u, y = length_v v, times a length to the fourth that drops
  // out of the ratio to the data.
  const double ratio = length_u / length_v, uu = 1 / (ratio * ratio), vv = ratio * ratio;
  for (std::size_t s = 0; s < rough_u_.size(); ++s) {
    for (std::size_t t = 0; t < rough_v_.size(); ++t) {
      const SpanRoughness &ru = rough_u_[s], &rv = rough_v_[t];
      const auto energy = [&](int k, int l) {
        const int a = k / 4, c = k % 4, b = l / 4, d = l % 4;
        return uu * ru[2](a, b) * rv[0](c, d) + 2 * ru[1](a, b) * rv[1](c, d) +
               vv * ru[0](a, b) * rv[2](c, d);
      };
      visit(static_cast<int>(s), static_cast<int>(t), energy);
    }
  }
}

double NetEquations::fairing_trace(double length_u, double length_v) const {
  double sum = 0;
  for_each_energy_cell(length_u, length_v, [&](int s, int t, const auto& energy) {
    for (int k = 0; k < 16; ++k) {
      if (place(s + k / 4, t + k % 4) >= 0) sum += energy(k, k);
    }
  });
  return sum;
}

void NetEquations::add_fairing(double factor, double length_u, double length_v, const BSplineSurface& base) {
  const int all = unknowns();
  for_each_energy_cell(length_u, length_v, [&](int s, int t, const auto& energy) {
    for (int k = 0; k < 16; ++k) {
      const int at = place(s + k / 4, t + k % 4);
      if (at < 0) continue;
      for (int l = 0; l < 16; ++l) {
        const double value = factor * energy(k, l);
        const int i = s + l / 4, j = t + l % 4, other = place(i, j);
        const double point[3] = {base.x(i, j), base.y(i, j), base.z(i, j)};
        for (int axis = 0; axis < 3; ++axis)
          right_[block_ == 3 ? at * 3 + axis : axis * all + at] -= value * point[axis];
        if (other < 0 || other > at) continue;
        for (int axis = 0; axis < block_; ++axis)
          matrix_.entry(at * block_ + axis, other * block_ + axis) += value;
      }
    }
  });
}

bool NetEquations::solve() {
  const int size = block_ * unknowns();
  if (!matrix_.factor(0, size)) return false;
  for (std::size_t begin = 0; begin < right_.size(); begin += static_cast<std::size_t>(size)) {
    const std::span<double> column(right_.data() + begin, static_cast<std::size_t>(size));
    matrix_.solve_lower(column, 0, size);
    matrix_.solve_upper(column, 0, size);
  }
  return true;
}

void NetEquations::add_solution_to(BSplineSurface& surface) const {
  Eigen::MatrixXd* nets[3] = {&surface.x, &surface.y, &surface.z};
  const int all = unknowns();
  for (int i = 0; i < control_u_; ++i) {
    for (int j = 0; j < control_v_; ++j) {
      const int at = place(i, j);
      if (at < 0) continue;
      for (int axis = 0; axis < 3; ++axis)
        (*nets[axis])(i, j) += right_[block_ == 3 ? at * 3 + axis : axis * all + at];
    }
  }
}

}  // namespace moldloft::geometry
