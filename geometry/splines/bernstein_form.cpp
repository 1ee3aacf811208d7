#include "geometry/splines/bernstein_form.hpp"

#include "geometry/splines/bernstein.hpp"

#include <algorithm>
#include <array>
#include <cassert>
#include <cstdint>

namespace moldloft::geometry {

namespace {

// Pascal's triangle in integers, each row behind the other: C(67, 33) = 1.42e19 is the last that fits.
constexpr int row_start(int n) { return n * (n + 1) / 2; }

constexpr auto pascal = [] {
  std::array<std::uint64_t, row_start(most_bernstein_degree + 1)> c{};
  for (int n = 0; n <= most_bernstein_degree; ++n) {
    for (int k = 0; k <= n; ++k) {
      const bool at_edge = k == 0 || k == n;
      c[row_start(n) + k] = at_edge ? 1 : c[row_start(n - 1) + k - 1] + c[row_start(n - 1) + k];
    }
  }
  return c;
}();

int degree_of(const FormRef& form) {
  assert(form.rows() >= 1);
  return static_cast<int>(form.rows()) - 1;
}

}  // namespace

double binomial(int n, int k) {
  assert(n >= 0 && n <= most_bernstein_degree);
  return k < 0 || k > n ? 0.0 : static_cast<double>(pascal[row_start(n) + k]);
}

Eigen::VectorXd bernstein_basis(int degree, double t) {
  assert(degree >= 0);
  Eigen::VectorXd basis(degree + 1);
  basis[0] = 1;
  for (int k = 0; k < degree; ++k) raise_bernstein(basis.data(), k, t);
  return basis;
}

Eigen::VectorXd bernstein_basis_by_definition(int degree, double t) {
  Eigen::VectorXd basis(degree + 1);
  double power = 1;
  for (int i = 0; i <= degree; ++i, power *= t) basis[i] = binomial(degree, i) * power;
  power = 1;
  for (int i = degree; i >= 0; --i, power *= 1 - t) basis[i] *= power;
  return basis;
}

Eigen::MatrixXd bernstein_derivatives(int degree, double t, int orders) {
  // The k-th derivative takes the basis of degree n - k and raises it k times by differences:
  // d/dt B_i^m = m (B_{i-1}^{m-1} - B_i^{m-1}).
  Eigen::MatrixXd derivatives = Eigen::MatrixXd::Zero(orders + 1, degree + 1);
  for (int k = 0; k <= std::min(orders, degree); ++k) {
    Eigen::VectorXd row = Eigen::VectorXd::Zero(degree + 1);
    row.head(degree - k + 1) = bernstein_basis(degree - k, t);
    for (int m = degree - k + 1; m <= degree; ++m) {
      for (int i = m; i > 0; --i) row[i] = m * (row[i - 1] - row[i]);
      row[0] *= -m;
    }
    derivatives.row(k) = row.transpose();
  }
  return derivatives;
}

Eigen::MatrixXd restrict_bernstein(int degree, double a, double b) {
  Eigen::MatrixXd r(degree + 1, degree + 1);
  for (int l = 0; l <= degree; ++l) {
    double* column = r.data() + l * (degree + 1);
    column[0] = 1;
    for (int k = 0; k < degree; ++k) raise_bernstein(column, k, k < degree - l ? a : b);
  }
  return r;
}

double product_factor(int n, int l, int m, int q) {
  return binomial(n, l) * binomial(m, q) / binomial(n + m, l + q);
}

Eigen::MatrixXd elevation_matrix(int degree, int raised) {
  assert(raised >= degree);
  Eigen::MatrixXd e(raised + 1, degree + 1);
  for (int p = 0; p <= raised; ++p) {
    for (int j = 0; j <= degree; ++j)
      e(p, j) = binomial(raised - degree, p - j) * binomial(degree, j) / binomial(raised, p);
  }
  return e;
}

Eigen::RowVectorXd form_at(const FormRef& form, double t) {
  BernsteinForm triangle = form;
  for (int left = degree_of(form); left > 0; --left) {
    for (int i = 0; i < left; ++i) triangle.row(i) = (1 - t) * triangle.row(i) + t * triangle.row(i + 1);
  }
  return triangle.row(0);
}

SplitForm split_form(const FormRef& form, double t) {
  const int n = degree_of(form);
  SplitForm halves{BernsteinForm(form.rows(), form.cols()), form};
  BernsteinForm& triangle = halves.right;  // its lower edge is left standing, its upper edge is the left half
  for (int level = 0; level <= n; ++level) {
    halves.left.row(level) = triangle.row(0);
    for (int i = 0; i < n - level; ++i) triangle.row(i) = (1 - t) * triangle.row(i) + t * triangle.row(i + 1);
  }
  return halves;
}

BernsteinForm differentiate_form(const FormRef& form) {
  const int n = degree_of(form);
  if (n == 0) return BernsteinForm::Zero(1, form.cols());
  return n * (form.bottomRows(n) - form.topRows(n));
}

BernsteinForm elevate_form(const FormRef& form, int raised) {
  return elevation_matrix(degree_of(form), raised) * form;
}

BernsteinForm restrict_form(const FormRef& form, double a, double b) {
  return restrict_bernstein(degree_of(form), a, b).transpose() * form;
}

BernsteinForm multiply_forms(const Eigen::Ref<const Eigen::VectorXd>& factor, const FormRef& form) {
  const int n = degree_of(factor), m = degree_of(form);
  BernsteinForm product = BernsteinForm::Zero(n + m + 1, form.cols());
  for (int l = 0; l <= n; ++l) {
    for (int q = 0; q <= m; ++q) product.row(l + q) += product_factor(n, l, m, q) * factor[l] * form.row(q);
  }
  return product;
}

}  // namespace moldloft::geometry
