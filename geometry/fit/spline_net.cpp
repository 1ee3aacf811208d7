#include "geometry/fit/spline_net.hpp"

#include "geometry/splines/bspline.hpp"
#include "geometry/splines/gauss_nodes.hpp"

#include <algorithm>
#include <cassert>

namespace moldloft::geometry {

namespace {

// N_a N_b in sextic Bernstein form, from both in cubic form (thesis eq. 3.7).
std::array<double, 7> product(const std::array<double, 4>& a, const std::array<double, 4>& b) {
  std::array<double, 7> p{};
  for (int i = 0; i < 4; ++i) {
    for (int j = 0; j < 4; ++j) p[i + j] += a[i] * b[j] * binomial3[i] * binomial3[j] / binomial6[i + j];
  }
  return p;
}

void fill_extraction(SpanTable::Span& span, std::span<const double> knots) {
  // The four Bezier points are a function's blossom at the cell's ends; only the eight knots around matter.
  const std::span<const double> near = knots.subspan(span.first, 8);
  const std::array<double, 8> ends{span.begin, span.begin, span.begin, span.begin,
                                   span.end,   span.end,   span.end,   span.end};
  for (int a = 0; a < 4; ++a) {
    std::array<double, 4> unit{};
    unit[a] = 1;
    for (int i = 0; i < 4; ++i) span.extraction[a][i] = refined_coefficient(near, unit, ends, i);
  }
}

void fill_products(SpanTable::Span& span) {
  for (auto& row : span.pair_rows) std::fill(row, row + 8, 0.0);
  for (auto& row : span.pair_columns) std::fill(row, row + 16, 0.0);
  for (int a = 0, ab = 0; a < 4; ++a) {
    for (int b = 0; b <= a; ++b, ++ab) {
      const std::array<double, 7> p = product(span.extraction[a], span.extraction[b]);
      for (int k = 0; k < 7; ++k) {
        span.pair_rows[ab][k] = span.pair_columns[k][4 * a + b] = span.pair_columns[k][4 * b + a] = p[k];
      }
    }
  }
}

void fill_roughness(SpanTable::Span& span, std::span<const double> knots) {
  span.roughness = {};
  const double h = span.end - span.begin;
  for (int g = 0; g < 4; ++g) {
    const BasisValues basis = cubic_basis(knots, span.first + cubic, span.begin + gauss_node[g] * h);
    for (int a = 0; a < 4; ++a) {
      for (int b = 0; b < 4; ++b) {
        span.roughness[0][a][b] += h * gauss_weight[g] * basis.value[a] * basis.value[b];
        span.roughness[1][a][b] += h * gauss_weight[g] * basis.first[a] * basis.first[b];
        span.roughness[2][a][b] += h * gauss_weight[g] * basis.second[a] * basis.second[b];
      }
    }
  }
}

}  // namespace

SpanTable::SpanTable(std::span<const double> knots)
    : cells_(knots), control_(static_cast<int>(knots.size()) - cubic - 1) {
  assert(control_ >= 4);
  table_.reserve(control_ - cubic);
  for (int k = cubic; k < control_; ++k) {
    if (!(knots[k] < knots[k + 1])) continue;
    Span& span = table_.emplace_back();
    span.first = k - cubic;
    span.begin = knots[k], span.end = knots[k + 1];
    fill_extraction(span, knots);
    fill_products(span);
    fill_roughness(span, knots);
  }
  for (int k = 0; k < 3; ++k) {
    roughness_[k].assign(control_, {});
    for (const Span& span : table_) {
      for (int a = 0; a < 4; ++a) {
        for (int b = 0; b < 4; ++b) roughness_[k][span.first + a][3 + b - a] += span.roughness[k][a][b];
      }
    }
  }
}

SplineNet::SplineNet(int spans_u, int spans_v)
    : SplineNet(uniform_clamped_knots(spans_u), uniform_clamped_knots(spans_v)) {}

SplineNet::SplineNet(std::span<const double> knots_u, std::span<const double> knots_v)
    : u_(std::make_shared<const SpanTable>(knots_u)), v_(std::make_shared<const SpanTable>(knots_v)) {}

CellMatrix SplineNet::gram(int cell_u, int cell_v, const CellMoments& moments) const {
  CellMatrix out;
  const SpanTable::Span &su = (*u_)[cell_u], &sv = (*v_)[cell_v];
  if (v_is_fast()) {
    moment_kernel().cell_gram(moments.gram.data(), su.pair_rows, sv.pair_columns, out.data());
    return out;
  }
  alignas(64) double turned[56] = {};
  for (int p = 0; p < 7; ++p) {
    for (int q = 0; q < 7; ++q) turned[q * 8 + p] = moments.gram[p * 8 + q];
  }
  moment_kernel().cell_gram(turned, sv.pair_rows, su.pair_columns, out.data());
  return out;
}

CellVector SplineNet::load(int cell_u, int cell_v, std::span<const double, 16> moments) const {
  const auto& eu = (*u_)[cell_u].extraction;
  const auto& ev = (*v_)[cell_v].extraction;
  CellVector half{}, out{};
  for (int a = 0; a < 4; ++a) {
    for (int i = 0; i < 4; ++i) {
      for (int j = 0; j < 4; ++j) half[a * 4 + j] += eu[a][i] * moments[i * 4 + j];
    }
    for (int c = 0; c < 4; ++c) {
      for (int j = 0; j < 4; ++j) out[a * 4 + c] += half[a * 4 + j] * ev[c][j];
    }
  }
  return out;
}

// x = length_u u, y = length_v v; a length to the fourth is left out.
std::pair<double, double> SplineNet::fairing_factors(double length_u, double length_v) const {
  const double ratio = length_u / length_v, squared = ratio * ratio;
  return v_is_fast() ? std::pair(1 / squared, squared) : std::pair(squared, 1 / squared);
}

CellMatrix SplineNet::fairing(int cell_u, int cell_v, double length_u, double length_v) const {
  const auto& slow = v_is_fast() ? (*u_)[cell_u].roughness : (*v_)[cell_v].roughness;
  const auto& fast = v_is_fast() ? (*v_)[cell_v].roughness : (*u_)[cell_u].roughness;
  const auto [ss, ff] = fairing_factors(length_u, length_v);
  CellMatrix out;
  for (int a = 0, ab = 0; a < 4; ++a) {
    for (int b = 0; b <= a; ++b, ++ab) {
      for (int d = 0; d < 4; ++d) {
        for (int c = 0; c < 4; ++c) {
          out[16 * ab + 4 * d + c] = ss * slow[2][a][b] * fast[0][d][c] + 2 * slow[1][a][b] * fast[1][d][c] +
                                     ff * slow[0][a][b] * fast[2][d][c];
        }
      }
    }
  }
  return out;
}

double SplineNet::fairing_trace(double length_u, double length_v) const {
  const auto [ss, ff] = fairing_factors(length_u, length_v);
  std::array<double, 3> of_slow{}, of_fast{};
  for (int k = 0; k < 3; ++k) {
    for (const auto& row : slow().roughness()[k]) of_slow[k] += row[3];
    for (const auto& row : fast().roughness()[k]) of_fast[k] += row[3];
  }
  return ss * of_slow[2] * of_fast[0] + 2 * of_slow[1] * of_fast[1] + ff * of_slow[0] * of_fast[2];
}

void SplineNet::add_fairing(BandCholesky& matrix, int first_row, int end_row, double length_u,
                            double length_v, double factor) const {
  const auto [ss, ff] = fairing_factors(length_u, length_v);
  const auto &s = slow().roughness(), &f = fast().roughness();
  const int step = fast().control();
  for (int i = first_row; i < end_row; ++i) {
    for (int k = std::max(0, i - 3); k <= i; ++k) {
      const double s2 = factor * ss * s[2][k][3 + i - k], s1 = factor * 2 * s[1][k][3 + i - k],
                   s0 = factor * ff * s[0][k][3 + i - k];
      for (int l = 0; l < step; ++l) {
        for (int j = i == k ? l : std::max(0, l - 3); j <= std::min(step - 1, l + 3); ++j) {
          const int d = 3 + j - l;
          matrix.entry(i * step + j, k * step + l) += s2 * f[0][l][d] + s1 * f[1][l][d] + s0 * f[2][l][d];
        }
      }
    }
  }
}

double SplineNet::fairing_energy(std::span<const double> c, int first_row, int end_row, double length_u,
                                 double length_v) const {
  const auto [ss, ff] = fairing_factors(length_u, length_v);
  const auto &s = slow().roughness(), &f = fast().roughness();
  const int step = fast().control();
  double energy = 0;
  for (int i = first_row; i < end_row; ++i) {
    for (int k = std::max(0, i - 3); k <= i; ++k) {
      const double s2 = ss * s[2][k][3 + i - k], s1 = 2 * s[1][k][3 + i - k], s0 = ff * s[0][k][3 + i - k];
      double pair = 0;
      for (int l = 0; l < step; ++l) {
        double inner = 0;
        for (int j = std::max(0, l - 3); j <= std::min(step - 1, l + 3); ++j) {
          const int d = 3 + j - l;
          inner += (s2 * f[0][l][d] + s1 * f[1][l][d] + s0 * f[2][l][d]) * c[i * step + j];
        }
        pair += inner * c[k * step + l];
      }
      energy += (i == k ? 1 : 2) * pair;
    }
  }
  return energy;
}

void SplineNet::add_to(BandCholesky& matrix, int cell_u, int cell_v, const CellMatrix& cell,
                       double factor) const {
  const int start = first_index(cell_u, cell_v), step = v_is_fast() ? control_v() : control_u();
  for (int a = 0, ab = 0; a < 4; ++a) {
    for (int b = 0; b <= a; ++b, ++ab) {
      for (int d = 0; d < 4; ++d) {
        const double* const in = &cell[16 * ab + 4 * d];
        double* const out = &matrix.entry(start + a * step, start + b * step + d);
        for (int c = a == b ? d : 0; c < 4; ++c) out[c] += factor * in[c];
      }
    }
  }
}

void SplineNet::add_to(std::span<double> vector, int cell_u, int cell_v, const CellVector& cell,
                       std::size_t stride) const {
  const int i = (*u_)[cell_u].first, j = (*v_)[cell_v].first;
  for (int k = 0; k < 16; ++k) vector[index(i + k / 4, j + k % 4) * stride] += cell[k];
}

void SplineNet::add_diagonal_to(std::span<double> vector, int cell_u, int cell_v,
                                const CellMatrix& cell) const {
  const int start = first_index(cell_u, cell_v), step = v_is_fast() ? control_v() : control_u();
  for (int a = 0; a < 4; ++a) {
    for (int c = 0; c < 4; ++c) vector[start + a * step + c] += cell[16 * (a * (a + 3) / 2) + 5 * c];
  }
}

double SplineNet::trace(const CellMatrix& cell) {
  double sum = 0;
  for (int a = 0; a < 4; ++a) {
    for (int c = 0; c < 4; ++c) sum += cell[16 * (a * (a + 3) / 2) + 5 * c];
  }
  return sum;
}

double SplineNet::energy(int cell_u, int cell_v, const CellMatrix& cell,
                         std::span<const double> coefficients) const {
  const int start = first_index(cell_u, cell_v), step = v_is_fast() ? control_v() : control_u();
  double sum = 0;
  for (int a = 0, ab = 0; a < 4; ++a) {
    for (int b = 0; b <= a; ++b, ++ab) {
      double pair = 0;
      for (int d = 0; d < 4; ++d) {
        double inner = 0;
        for (int c = 0; c < 4; ++c) inner += cell[16 * ab + 4 * d + c] * coefficients[start + a * step + c];
        pair += inner * coefficients[start + b * step + d];
      }
      sum += (a == b ? 1 : 2) * pair;
    }
  }
  return sum;
}

CellVector SplineNet::bezier(std::span<const double> coefficients, int cell_u, int cell_v) const {
  const auto& eu = (*u_)[cell_u].extraction;
  const auto& ev = (*v_)[cell_v].extraction;
  const CellVector c = gather(coefficients, cell_u, cell_v);
  CellVector half{}, out{};
  for (int a = 0; a < 4; ++a) {
    for (int j = 0; j < 4; ++j) {
      for (int b = 0; b < 4; ++b) half[a * 4 + j] += ev[b][j] * c[a * 4 + b];
    }
    for (int i = 0; i < 4; ++i) {
      for (int j = 0; j < 4; ++j) out[i * 4 + j] += eu[a][i] * half[a * 4 + j];
    }
  }
  return out;
}

CellVector SplineNet::gather(std::span<const double> coefficients, int cell_u, int cell_v) const {
  const int i = (*u_)[cell_u].first, j = (*v_)[cell_v].first;
  CellVector out;
  for (int k = 0; k < 16; ++k) out[k] = coefficients[index(i + k / 4, j + k % 4)];
  return out;
}

}  // namespace moldloft::geometry
