#include "geometry/splines/bernstein_form.hpp"

#include "geometry/splines/bernstein.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <limits>
#include <random>

using namespace moldloft::geometry;

namespace {

constexpr double eps = std::numeric_limits<double>::epsilon();
const std::vector<double> places{0, 1e-9, 0.1, 0.3, 0.5, 0.77, 0.999, 1};

// C(n, k) by its quotients in extended precision, not by Pascal's triangle.
long double choose(int n, int k) {
  long double c = 1;
  for (int i = 1; i <= k; ++i) c = c * (n - k + i) / i;
  return std::roundl(c);
}

long double exact_bernstein(int n, int i, long double t) {
  return choose(n, i) * powl(t, i) * powl(1 - t, n - i);
}

// The value of a form of one axis by the definition, in extended precision.
long double exact_value(const Eigen::VectorXd& form, long double t) {
  const int n = static_cast<int>(form.size()) - 1;
  long double sum = 0;
  for (int i = 0; i <= n; ++i) sum += form[i] * exact_bernstein(n, i, t);
  return sum;
}

struct Numbers {
  std::mt19937 random{7};
  double in(double low, double high) { return std::uniform_real_distribution<double>(low, high)(random); }
  Eigen::MatrixXd form(int degree, int axes) {
    return Eigen::MatrixXd::NullaryExpr(degree + 1, axes, [&] { return in(-1, 1); });
  }
};

}  // namespace

TEST_CASE("binomial coefficients are exact while a double can hold them") {
  CHECK(binomial(0, 0) == 1);
  CHECK(binomial(6, 3) == 20);
  CHECK(binomial(6, 7) == 0);
  CHECK(binomial(6, -1) == 0);
  CHECK(binomial(56, 28) == 7648690600760440.0);
  CHECK(binomial(60, 30) == 118264581564861424.0);  // 118264581564861424 is a multiple of 16: still exact
  CHECK(binomial(67, 33) == 14226520737620288370.0);
  for (int n = 1; n <= most_bernstein_degree; ++n) {
    double alternating = 0;
    for (int k = 0; k <= n; ++k) {
      CHECK(binomial(n, k) == binomial(n, n - k));
      if (n <= 56) alternating += (k % 2 ? -1 : 1) * binomial(n, k);
      CHECK(std::abs(binomial(n, k) / static_cast<double>(choose(n, k)) - 1) <= eps);
    }
    CHECK(alternating == 0);  // partial sums are binomial coefficients of n - 1: no rounding
  }
}

TEST_CASE("Bernstein polynomials by recurrence and by definition keep their bounds") {
  for (int n : {0, 1, 2, 3, 7, 24, 48, 60, 67}) {
    for (const double t : places) {
      const Eigen::VectorXd steps = bernstein_basis(n, t), direct = bernstein_basis_by_definition(n, t);
      for (int i = 0; i <= n; ++i) {
        const double exact = static_cast<double>(exact_bernstein(n, i, t));
        if (exact < 1e-290) continue;  // what underflows on the way has no relative accuracy left
        CHECK(std::abs(steps[i] - exact) <= (2 * n + 1) * eps * exact);  // one eps for `exact` itself
        CHECK(std::abs(direct[i] - exact) <= (n + 3) * eps * exact);
      }
      CHECK(steps.minCoeff() >= 0);
      CHECK(std::abs(steps.sum() - 1) <= 2 * (n + 1) * eps);  // partition of unity
    }
  }
}

TEST_CASE("the fixed-size restriction and that of any degree are the same numbers") {
  for (const auto& [a, b] : {std::pair{0.0, 1.0}, {0.25, 0.5}, {0.9, 0.2}, {0.3, 0.3}}) {
    const auto three = restriction<3>(a, b);
    const auto six = restriction<6>(a, b);
    const Eigen::MatrixXd any_three = restrict_bernstein(3, a, b), any_six = restrict_bernstein(6, a, b);
    for (int i = 0; i <= 3; ++i)
      for (int l = 0; l <= 3; ++l) CHECK(three[i][l] == any_three(i, l));
    for (int i = 0; i <= 6; ++i)
      for (int l = 0; l <= 6; ++l) CHECK(six[i][l] == any_six(i, l));
  }
}

TEST_CASE("a restricted Bernstein basis is the thesis's double sum of products") {
  Numbers numbers;
  for (int n : {1, 2, 3, 5, 12, 24, 40}) {
    for (int trial = 0; trial < 4; ++trial) {
      const double a = numbers.in(0, 1), b = numbers.in(0, 1);
      const Eigen::MatrixXd r = restrict_bernstein(n, a, b);
      for (int i = 0; i <= n; ++i) {
        for (int l = 0; l <= n; ++l) {
          long double sum = 0;  // (3.6)
          for (int k = std::max(0, i - (n - l)); k <= std::min(i, l); ++k)
            sum += exact_bernstein(l, k, b) * exact_bernstein(n - l, i - k, a);
          const double exact = static_cast<double>(sum);
          CHECK(std::abs(r(i, l) - exact) <= (2 * n + 1) * eps * exact);
        }
      }
      for (int l = 0; l <= n; ++l) CHECK(std::abs(r.col(l).sum() - 1) <= 2 * (n + 1) * eps);
    }
  }
}

TEST_CASE("a form restricted to a segment has the values of the whole one there") {
  Numbers numbers;
  for (int n : {0, 1, 3, 8, 24}) {
    const Eigen::MatrixXd form = numbers.form(n, 1);
    const auto [a, b] = std::pair{0.83, 0.21};
    const BernsteinForm piece = restrict_form(form, a, b);
    for (const double t : places) {
      const long double exact = exact_value(form, a + (static_cast<long double>(b) - a) * t);
      CHECK(std::abs(static_cast<double>(exact_value(piece, t) - exact)) <= std::max(4 * n, 1) * eps);
    }
  }
}

TEST_CASE("derivatives of the basis are differences of lower degrees") {
  CHECK(bernstein_derivatives(3, 0.5, 2).row(1) == Eigen::RowVector4d(-0.75, -0.75, 0.75, 0.75));
  CHECK(bernstein_derivatives(3, 0.0, 3).row(2) == Eigen::RowVector4d(6, -12, 6, 0));
  CHECK(bernstein_derivatives(2, 0.3, 4).bottomRows(2).norm() == 0);
  // Closed form: the k-th derivative is n!/(n-k)! times the k-th difference of the basis of degree n - k.
  for (int n : {2, 5, 12, 24}) {
    for (const double t : places) {
      const Eigen::MatrixXd d = bernstein_derivatives(n, t, 3);
      double falling = 1;
      for (int k = 0; k <= 3 && k <= n; ++k) {
        for (int i = 0; i <= n; ++i) {
          long double sum = 0;
          for (int j = 0; j <= k; ++j) {
            const int low = i - j;
            if (low < 0 || low > n - k) continue;
            sum += ((k - j) % 2 ? -1 : 1) * choose(k, j) * exact_bernstein(n - k, low, t);
          }
          const double bound = std::max(std::ldexp(falling, k + 1) * n, 1.0) * eps;
          CHECK(std::abs(d(k, i) - falling * static_cast<double>(sum)) <= bound);
        }
        falling *= n - k;
      }
    }
  }
}

TEST_CASE("de Casteljau evaluates and splits a form within its bound") {
  Numbers numbers;
  for (int n : {0, 1, 3, 9, 24, 60}) {
    const Eigen::MatrixXd form = numbers.form(n, 2);
    for (const double t : places) {
      const Eigen::RowVectorXd value = form_at(form, t);
      for (int axis = 0; axis < 2; ++axis) {
        const double exact = static_cast<double>(exact_value(form.col(axis), t));
        CHECK(std::abs(value[axis] - exact) <= (2 * n + 1) * eps);
      }
      const SplitForm halves = split_form(form, t);
      CHECK(halves.left.row(0) == form.row(0));
      CHECK(halves.right.row(n) == form.row(n));
      CHECK(halves.left.row(n) == halves.right.row(0));
      for (const double s : places) {
        const long double low = static_cast<long double>(t) * s,
                          high = t + (1 - static_cast<long double>(t)) * s;
        CHECK(std::abs(static_cast<double>(exact_value(halves.left.col(0), s) -
                                           exact_value(form.col(0), low))) <= (2 * n + 1) * eps);
        CHECK(std::abs(static_cast<double>(exact_value(halves.right.col(0), s) -
                                           exact_value(form.col(0), high))) <= (2 * n + 1) * eps);
      }
    }
  }
}

TEST_CASE("a form of raised degree is the same polynomial") {
  CHECK(elevation_matrix(1, 2) == (Eigen::MatrixXd(3, 2) << 1, 0, 0.5, 0.5, 0, 1).finished());
  Numbers numbers;
  for (const auto& [n, raised] : {std::pair{0, 5}, {3, 3}, {3, 4}, {3, 6}, {3, 48}, {24, 60}}) {
    const Eigen::MatrixXd e = elevation_matrix(n, raised);
    CHECK(e.minCoeff() >= 0);
    for (int p = 0; p <= raised; ++p) CHECK(std::abs(e.row(p).sum() - 1) <= (n + 4) * eps);
    Eigen::MatrixXd step_by_step = numbers.form(n, 1);
    const Eigen::MatrixXd form = step_by_step;
    for (int degree = n; degree < raised; ++degree) {  // (2.39) one degree at a time, from the definition
      Eigen::MatrixXd next = Eigen::MatrixXd::Zero(degree + 2, 1);
      for (int i = 0; i <= degree + 1; ++i) {
        const double share = i / (degree + 1.0);
        if (i > 0) next(i) += share * step_by_step(i - 1);
        if (i <= degree) next(i) += (1 - share) * step_by_step(i);
      }
      step_by_step = next;
    }
    const BernsteinForm at_once = elevate_form(form, raised);
    CHECK((at_once - step_by_step).cwiseAbs().maxCoeff() <= (n + 3 + 2 * (raised - n)) * eps);
    for (const double t : places) {
      const double error = static_cast<double>(exact_value(at_once, t) - exact_value(form, t));
      CHECK(std::abs(error) <= (n + 3) * eps);
    }
  }
}

TEST_CASE("the product of two forms is the product of their values") {
  CHECK(product_factor(3, 1, 3, 1) == 9.0 / 15.0);
  CHECK(product_factor(2, 1, 4, 2) == 12.0 / 20.0);
  Numbers numbers;
  for (const auto& [n, m] : {std::pair{0, 3}, {1, 1}, {3, 3}, {5, 2}, {24, 24}, {30, 30}}) {
    const Eigen::MatrixXd f = numbers.form(n, 1), g = numbers.form(m, 2);
    const BernsteinForm product = multiply_forms(f, g);
    CHECK(product.rows() == n + m + 1);
    for (const double t : places) {
      for (int axis = 0; axis < 2; ++axis) {
        const long double exact = exact_value(f, t) * exact_value(g.col(axis), t);
        const double error = static_cast<double>(exact_value(product.col(axis), t) - exact);
        CHECK(std::abs(error) <= (std::min(n, m) + 4) * eps);
      }
    }
  }
}

TEST_CASE("the derivative of a form is that of its polynomial") {
  Numbers numbers;
  for (int n : {0, 1, 3, 10}) {
    const Eigen::MatrixXd form = numbers.form(n, 1);
    const BernsteinForm derivative = differentiate_form(form);
    for (const double t : {0.2, 0.5, 0.9}) {
      long double exact = 0;  // sum of c_i C(n, i) (i t^(i-1) (1-t)^(n-i) - (n-i) t^i (1-t)^(n-i-1))
      for (int i = 0; i <= n; ++i) {
        const long double s = 1 - static_cast<long double>(t);
        exact += form(i) * choose(n, i) *
                 ((i > 0 ? i * powl(t, i - 1) * powl(s, n - i) : 0) -
                  (i < n ? (n - i) * powl(t, i) * powl(s, n - i - 1) : 0));
      }
      CHECK(std::abs(static_cast<double>(exact_value(derivative, t) - exact)) <= std::max(2 * n, 1) * eps);
    }
  }
}

TEST_CASE("an affine map of the coefficients is the affine map of every value") {
  Numbers numbers;
  const Eigen::MatrixXd form = numbers.form(9, 3);
  const Eigen::Matrix3d turn = Eigen::Matrix3d::NullaryExpr([&] { return numbers.in(-1, 1); });
  const Eigen::RowVector3d shift(3, -2, 5);
  const Eigen::MatrixXd moved = (form * turn).rowwise() + shift;
  for (const double t : places) {
    const Eigen::RowVectorXd of_value = form_at(form, t) * turn + shift;
    CHECK((form_at(moved, t) - of_value).cwiseAbs().maxCoeff() <= 2 * (2 * 9 + 4) * eps * 8);  // net <= 3 + 5
  }
}
