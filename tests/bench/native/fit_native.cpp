#include "bench/native/fit_native.hpp"

#include <Eigen/Sparse>
#include <Eigen/SparseCholesky>

#include <algorithm>
#include <cstring>
#include <vector>

namespace moldloft::bench::native {

namespace {

typedef double Eight __attribute__((vector_size(64)));
typedef double EightLoose __attribute__((vector_size(64), aligned(8), may_alias));
typedef int EightInt __attribute__((vector_size(32)));

struct Basis {
  int span;
  double value[4];
};

// De Boor's recurrence on uniform clamped knots.
Basis basis_at(double t, int spans) {
  const int k = std::min(static_cast<int>(t * spans), spans - 1);
  const auto knot = [&](int i) { return std::clamp(i - 3, 0, spans) / double(spans); };
  Basis b{k, {1, 0, 0, 0}};
  double left[4], right[4];
  for (int j = 1; j <= 3; ++j) {
    left[j] = t - knot(k + 4 - j), right[j] = knot(k + 3 + j) - t;
    double saved = 0;
    for (int r = 0; r < j; ++r) {
      const double term = b.value[r] / (right[r + 1] + left[j - r]);
      b.value[r] = saved + right[r + 1] * term;
      saved = left[j - r] * term;
    }
    b.value[j] = saved;
  }
  return b;
}

}  // namespace

double moldloft_read_floor(const double* u, const double* v, const double* z, std::size_t points) {
  Eight sum = {};
  std::size_t i = 0;
  for (; i + 8 <= points; i += 8) {
    sum += *reinterpret_cast<const EightLoose*>(u + i) + *reinterpret_cast<const EightLoose*>(v + i) +
           *reinterpret_cast<const EightLoose*>(z + i);
  }
  double all = 0;
  for (int k = 0; k < 8; ++k) all += sum[k];
  for (; i < points; ++i) all += u[i] + v[i] + z[i];
  return all;
}

double moldloft_basis_floor(const double* u, const double* v, std::size_t points, int spans) {
  Eight sums[16] = {};
  EightInt cells = {};
  const double last = spans;
  // De Boor's recurrence on clamped knots, which are whole numbers in units of a span.
  const auto basis = [&](const double* at, EightInt& span, Eight out[4]) {
    const Eight x = *reinterpret_cast<const EightLoose*>(at) * last;
    span = __builtin_convertvector(x, EightInt);
    const Eight k = __builtin_convertvector(span, Eight), zero = {}, end = zero + last;
    const auto inside = [&](Eight knot) {
      knot = knot < zero ? zero : knot;
      return knot > end ? end : knot;
    };
    const Eight left1 = x - k, right1 = k + 1.0 - x, left2 = x - inside(k - 1.0), left3 = x - inside(k - 2.0);
    const Eight right2 = inside(k + 2.0) - x, right3 = inside(k + 3.0) - x;
    const Eight a1 = 1.0 / (right1 + left2), a2 = 1.0 / (right2 + left1);
    const Eight q0 = right1 * right1 * a1, q1 = left2 * right1 * a1 + right2 * left1 * a2,
                q2 = left1 * left1 * a2;
    const Eight b1 = q0 / (right1 + left3), b2 = q1 / (right2 + left2), b3 = q2 / (right3 + left1);
    out[0] = right1 * b1, out[1] = left3 * b1 + right2 * b2, out[2] = left2 * b2 + right3 * b3,
    out[3] = left1 * b3;
  };
  for (std::size_t i = 0; i + 8 <= points; i += 8) {
    EightInt span_u, span_v;
    Eight bu[4], bv[4];
    basis(u + i, span_u, bu), basis(v + i, span_v, bv);
    cells += span_u * spans + span_v;
    for (int a = 0; a < 4; ++a) {
      for (int b = 0; b < 4; ++b) sums[4 * a + b] += bu[a] * bv[b];
    }
  }
  double all = 0;
  for (int k = 0; k < 8; ++k) {
    for (const Eight& sum : sums) all += sum[k];
    all += cells[k];
  }
  return all;
}

bool moldloft_plain_eigen_fit(const double* u, const double* v, const double* z, std::size_t points,
                              int control, double* control_points) {
  using Matrix = Eigen::SparseMatrix<double, Eigen::RowMajor, int>;
  const int spans = control - 3;
  Matrix a(static_cast<Eigen::Index>(points), control * control);
  a.resizeNonZeros(static_cast<Eigen::Index>(16 * points));
  for (std::size_t i = 0; i < points; ++i) {
    a.outerIndexPtr()[i] = static_cast<int>(16 * i);
    const Basis bu = basis_at(u[i], spans), bv = basis_at(v[i], spans);
    for (int p = 0; p < 4; ++p) {
      for (int q = 0; q < 4; ++q) {
        a.innerIndexPtr()[16 * i + 4 * p + q] = (bu.span + p) * control + bv.span + q;
        a.valuePtr()[16 * i + 4 * p + q] = bu.value[p] * bv.value[q];
      }
    }
  }
  a.outerIndexPtr()[points] = static_cast<int>(16 * points);
  const Eigen::Map<const Eigen::VectorXd> right(z, static_cast<Eigen::Index>(points));
  const Eigen::SparseMatrix<double> normal = a.transpose() * a;
  const Eigen::SimplicialLLT<Eigen::SparseMatrix<double>> factor(normal);
  if (factor.info() != Eigen::Success) return false;
  const Eigen::VectorXd solution = factor.solve(a.transpose() * right);
  std::memcpy(control_points, solution.data(), sizeof(double) * solution.size());
  return true;
}

}  // namespace moldloft::bench::native
