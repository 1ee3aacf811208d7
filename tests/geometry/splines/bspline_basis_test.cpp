#include "geometry/splines/bspline_basis.hpp"

#include "geometry/splines/bernstein_form.hpp"
#include "geometry/splines/spline_samples.hpp"

#include <doctest/doctest.h>

using namespace moldloft::geometry;
using samples::eps, samples::Numbers;

TEST_CASE("basis functions of any degree follow their definition, add up to one and are not negative") {
  Numbers numbers;
  for (int p : {0, 1, 2, 3, 4, 7}) {
    const auto knots = numbers.knots(p, 6);
    for (double t = 0; t <= 1; t += 0.0411) {
      const int k = find_span(knots, t, p);
      std::vector<double> values(p + 1);
      basis_functions(knots, p, k, t, values);
      double sum = 0;
      for (int i = 0; i <= p; ++i) {
        const double exact = static_cast<double>(samples::basis(knots, k - p + i, p, t));
        CHECK(std::abs(values[i] - exact) <= (4 * p + 1) * eps * exact);
        CHECK(values[i] >= 0);
        sum += values[i];
      }
      CHECK(std::abs(sum - 1) <= (5 * p + 1) * eps);
    }
  }
}

TEST_CASE("derivatives of any order are those of the definition") {
  Numbers numbers;
  for (int p : {0, 1, 2, 3, 4, 6}) {
    const auto knots = numbers.knots(p, 5);
    for (double t = 0.003; t < 1; t += 0.083) {
      const int k = find_span(knots, t, p), orders = p + 1, width = p + 1;
      std::vector<double> d(static_cast<std::size_t>((orders + 1) * width));
      basis_derivatives(knots, p, k, t, orders, d);
      for (int m = 0; m <= orders; ++m) {
        for (int i = 0; i <= p; ++i) {
          const double exact = static_cast<double>(samples::basis_derivative(knots, k - p + i, p, m, t));
          const double size = static_cast<double>(samples::basis_derivative(knots, k - p + i, p, m, t, 1));
          CHECK(std::abs(d[m * width + i] - exact) <= (4 * p + 1) * eps * size);
        }
      }
    }
  }
}

TEST_CASE("the cubic basis written out is that of any degree at three") {
  Numbers numbers;
  const auto knots = numbers.knots(3, 8);
  for (double t = 0; t <= 1; t += 0.0173) {
    const int k = find_span(knots, t);
    std::array<double, 12> d;
    basis_derivatives(knots, 3, k, t, 2, d);
    const BasisValues cubic_values = cubic_basis(knots, k, t);
    for (int i = 0; i < 4; ++i) {
      const auto size = [&](int m) {
        return static_cast<double>(samples::basis_derivative(knots, k - 3 + i, 3, m, t, 1));
      };
      CHECK(std::abs(cubic_values.value[i] - d[i]) <= 24 * eps * size(0));
      CHECK(std::abs(cubic_values.first[i] - d[4 + i]) <= 24 * eps * size(1));
      CHECK(std::abs(cubic_values.second[i] - d[8 + i]) <= 24 * eps * size(2));
    }
  }
}

TEST_CASE(
    "a piece in Bernstein form is the basis on its segment, within the bound and without a negative entry") {
  Numbers numbers;
  for (int p : {0, 1, 2, 3, 5}) {
    const auto knots = numbers.knots(p, 6);
    for (const int k : filled_spans(knots, p)) {
      for (const auto& [from, to] : {std::pair{0.0, 1.0}, {0.2, 0.7}, {0.9, 0.1}}) {
        const double length = knots[k + 1] - knots[k];
        const double a = knots[k] + from * length, b = to == 1 ? knots[k + 1] : knots[k] + to * length;
        const Eigen::MatrixXd m = piece_extraction(knots, p, k, a, b);
        CHECK(m.minCoeff() >= 0);
        for (int l = 0; l <= p; ++l) CHECK(std::abs(m.col(l).sum() - 1) <= (5 * p + 1) * eps);
        for (const double s : {0.1, 0.5, 0.93}) {
          const long double t = a + (static_cast<long double>(b) - a) * s;
          const Eigen::VectorXd bernstein_values = bernstein_basis(p, s);
          for (int i = 0; i <= p; ++i) {
            const double exact = static_cast<double>(samples::basis(knots, k - p + i, p, t));
            CHECK(std::abs(m.row(i).dot(bernstein_values) - exact) <= (4 * p + 2 * p + p + 2) * eps * exact);
          }
        }
      }
    }
  }
}
