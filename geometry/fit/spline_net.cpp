#include "geometry/fit/spline_net.hpp"

#include <algorithm>

#include "geometry/splines/bspline.hpp"

namespace moldloft::geometry {

namespace {

// Four Gauss nodes and weights on [0, 1]: exact to degree 7, and a product of two cubics has 6.
constexpr std::array<double, 4> gauss_node{0.06943184420297371, 0.33000947820757187, 0.66999052179242813,
                                           0.93056815579702629};
constexpr std::array<double, 4> gauss_weight{0.17392742256872693, 0.32607257743127307, 0.32607257743127307,
                                             0.17392742256872693};

}  // namespace

SpanTable::SpanTable(int spans) : table_(spans) {
  const std::vector<double> knots = uniform_clamped_knots(spans);
  for (int k = 0; k < spans; ++k) {
    Span& span = table_[k];
    const std::array<double, 2> bezier{knots[k + cubic], knots[k + cubic + 1]};
    const std::vector<double> ends{bezier[0], bezier[0], bezier[0], bezier[0],
                                   bezier[1], bezier[1], bezier[1], bezier[1]};
    for (int a = 0; a < 4; ++a) {
      std::vector<double> unit(spans + cubic, 0.0);
      unit[k + a] = 1;
      // The four Bezier points are the function's blossom at the cell's ends.
      for (int i = 0; i < 4; ++i) span.extraction[a][i] = refined_coefficient(knots, unit, ends, i);
    }
    for (int a = 0; a < 4; ++a) {
      for (int b = 0; b < 4; ++b) {
        span.product[a][b].fill(0);
        for (int i = 0; i < 4; ++i) {
          for (int j = 0; j < 4; ++j) {
            span.product[a][b][i + j] += span.extraction[a][i] * span.extraction[b][j] * binomial3[i] *
                                         binomial3[j] / binomial6[i + j];
          }
        }
      }
    }
    span.roughness = {};
    const double h = bezier[1] - bezier[0];
    for (int g = 0; g < 4; ++g) {
      const BasisValues basis = cubic_basis(knots, k + cubic, bezier[0] + gauss_node[g] * h);
      for (int a = 0; a < 4; ++a) {
        for (int b = 0; b < 4; ++b) {
          span.roughness[0][a][b] += h * gauss_weight[g] * basis.value[a] * basis.value[b];
          span.roughness[1][a][b] += h * gauss_weight[g] * basis.first[a] * basis.first[b];
          span.roughness[2][a][b] += h * gauss_weight[g] * basis.second[a] * basis.second[b];
        }
      }
    }
  }
}

SplineNet::SplineNet(int spans_u, int spans_v) : u_(spans_u), v_(spans_v) {}

CellMatrix SplineNet::gram(int cell_u, int cell_v, const CellMoments& moments) const {
  const auto& pu = u_[cell_u].product;
  const auto& pv = v_[cell_v].product;
  CellMatrix out;
  for (int a = 0; a < 4; ++a) {
    for (int b = a; b < 4; ++b) {
      std::array<double, 7> half{};
      for (int p = 0; p < 7; ++p) {
        for (int q = 0; q < 7; ++q) half[q] += pu[a][b][p] * moments.gram[p * 7 + q];
      }
      for (int c = 0; c < 4; ++c) {
        for (int d = c; d < 4; ++d) {
          double sum = 0;
          for (int q = 0; q < 7; ++q) sum += half[q] * pv[c][d][q];
          out[a * 4 + c][b * 4 + d] = out[a * 4 + d][b * 4 + c] = sum;
          out[b * 4 + c][a * 4 + d] = out[b * 4 + d][a * 4 + c] = sum;
        }
      }
    }
  }
  return out;
}

CellVector SplineNet::load(int cell_u, int cell_v, std::span<const double, 16> moments) const {
  const auto& eu = u_[cell_u].extraction;
  const auto& ev = v_[cell_v].extraction;
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

CellMatrix SplineNet::fairing(int cell_u, int cell_v, double length_u, double length_v) const {
  const auto& ru = u_[cell_u].roughness;
  const auto& rv = v_[cell_v].roughness;
  // z_xx^2 + 2 z_xy^2 + z_yy^2 with x = length_u u, y = length_v v, times a length to the fourth that drops
  // out of the ratio to the data.
  const double ratio = length_u / length_v, uu = 1 / (ratio * ratio), vv = ratio * ratio;
  CellMatrix out;
  for (int a = 0; a < 4; ++a) {
    for (int c = 0; c < 4; ++c) {
      for (int b = 0; b < 4; ++b) {
        for (int d = 0; d < 4; ++d) {
          out[a * 4 + c][b * 4 + d] =
              uu * ru[2][a][b] * rv[0][c][d] + 2 * ru[1][a][b] * rv[1][c][d] + vv * ru[0][a][b] * rv[2][c][d];
        }
      }
    }
  }
  return out;
}

void SplineNet::add_to(BandCholesky& matrix, int cell_u, int cell_v, const CellMatrix& cell,
                       double factor) const {
  std::array<int, 16> place;
  for (int k = 0; k < 16; ++k) place[k] = index(cell_u + k / 4, cell_v + k % 4);
  for (int k = 0; k < 16; ++k) {
    for (int l = 0; l < 16; ++l) {
      if (place[k] >= place[l]) matrix.entry(place[k], place[l]) += factor * cell[k][l];
    }
  }
}

void SplineNet::add_to(std::span<double> vector, int cell_u, int cell_v, const CellVector& cell) const {
  for (int k = 0; k < 16; ++k) vector[index(cell_u + k / 4, cell_v + k % 4)] += cell[k];
}

CellVector SplineNet::gather(std::span<const double> coefficients, int cell_u, int cell_v) const {
  CellVector out;
  for (int k = 0; k < 16; ++k) out[k] = coefficients[index(cell_u + k / 4, cell_v + k % 4)];
  return out;
}

}  // namespace moldloft::geometry
