#include "geometry/splines/banded_least_squares.hpp"

#include "geometry/splines/spline_samples.hpp"

#include <Eigen/QR>
#include <Eigen/SVD>
#include <doctest/doctest.h>

using namespace moldloft::geometry;
using samples::eps, samples::Numbers;

TEST_CASE("banded least squares is the dense least squares solution") {
  Numbers numbers;
  for (const auto& [unknowns, band, equations] : {std::tuple{12, 4, 60}, {7, 7, 20}, {5, 1, 9}, {9, 3, 9}}) {
    BandedLeastSquares system(unknowns, band, 2);
    Eigen::MatrixXd a = Eigen::MatrixXd::Zero(equations, unknowns), b(equations, 2);
    for (int row = 0; row < equations; ++row) {  // in no order, and sometimes narrower than the band
      const int first = row < unknowns ? std::min(row, unknowns - band) : numbers.of(0, unknowns - band);
      const int width = row < unknowns ? band : numbers.of(1, band);
      std::vector<double> coefficients(width);
      for (int i = 0; i < width; ++i) a(row, first + i) = coefficients[i] = numbers.in(0.1, 1);
      const double right[2] = {numbers.in(-1, 1), numbers.in(-1, 1)};
      b.row(row) << right[0], right[1];
      system.add(first, coefficients, right);
    }
    const Eigen::JacobiSVD<Eigen::MatrixXd> svd(a);
    const double condition = svd.singularValues()(0) / svd.singularValues()(unknowns - 1);
    const Eigen::MatrixXd dense = a.colPivHouseholderQr().solve(b);
    const auto x = system.solve();
    REQUIRE(x.has_value());
    const double bound = 4 * equations * band * eps * condition * condition * dense.norm();
    CHECK((*x - dense).norm() <= bound);
    CHECK(system.residual_squares() == doctest::Approx((a * dense - b).squaredNorm()).epsilon(1e-10));
    CHECK(system.pivots().ratio() >= 1 / condition * (1 - 1e-12));
  }
}

TEST_CASE("a system that does not determine an unknown says which") {
  BandedLeastSquares system(4, 2, 1);
  for (int i = 0; i < 3; ++i) {
    const double one[] = {1}, right[] = {2.0};
    system.add(i == 2 ? 3 : i, one, right);
  }
  CHECK(system.solve().error() == Error::singular);
  CHECK(system.pivots().weakest == 2);
  CHECK(system.pivots().smallest == 0);
  CHECK(BandedLeastSquares(3, 2, 1).solve().error() == Error::singular);
}
