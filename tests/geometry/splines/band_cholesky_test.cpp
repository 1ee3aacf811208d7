#include "geometry/splines/band_cholesky.hpp"

#include "geometry/heap_watch.hpp"
#include "geometry/splines/band_condition.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <doctest/doctest.h>

#include <cstring>
#include <limits>
#include <random>
#include <vector>

using namespace moldloft;
using namespace moldloft::geometry;

namespace {

constexpr Simd every_simd[] = {Simd::portable, Simd::avx2, Simd::avx512};
constexpr double eps = std::numeric_limits<double>::epsilon();

struct Size {
  int n, band;
};
// Wider than the matrix, narrower than a panel, and what nets have.
constexpr Size sizes[] = {{1, 0}, {5, 3}, {7, 20}, {40, 1}, {64, 27}, {100, 8}, {133, 51}};

Eigen::MatrixXd random_band(const Size& size, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> unit(-1, 1);
  Eigen::MatrixXd m = Eigen::MatrixXd::Zero(size.n, size.n);
  for (int j = 0; j < size.n; ++j) {
    for (int i = j; i < std::min(size.n, j + size.band + 1); ++i) m(i, j) = m(j, i) = unit(random);
    m(j, j) = 2 * size.band + 1;
  }
  return m;
}

void fill(BandCholesky& band, const Eigen::MatrixXd& m, int half_band) {
  const int n = static_cast<int>(m.rows());
  band.reset(n, half_band);
  band.clear(0, n);
  for (int j = 0; j < n; ++j) {
    for (int i = j; i < std::min(n, j + half_band + 1); ++i) band.entry(i, j) = m(i, j);
  }
}

// The factor and some solutions, as one row of numbers.
std::vector<double> all_numbers(BandCholesky& band, const Eigen::MatrixXd& m, int half_band, int slice) {
  const int n = static_cast<int>(m.rows());
  fill(band, m, half_band);
  for (int k = 0; k < n; k += slice) REQUIRE(band.factor(k, std::min(n, k + slice)));
  std::vector<double> out;
  for (int j = 0; j < n; ++j) {
    for (int i = j; i < std::min(n, j + half_band + 1); ++i) out.push_back(band.entry(i, j));
  }
  std::vector<double> x(n), many(16 * n);
  for (int i = 0; i < n; ++i) {
    x[i] = std::sin(i);
    for (int s = 0; s < 16; ++s) many[16 * i + s] = std::sin(i + s);
  }
  for (int k = 0; k < n; k += slice) band.solve_lower(x, k, std::min(n, k + slice));
  for (int k = 0; k < n; k += slice) band.solve_lower_many(many, 16, 8, 8, k, std::min(n, k + slice));
  out.insert(out.end(), x.begin(), x.end());
  for (int k = n; k > 0; k -= slice) band.solve_upper(x, std::max(0, k - slice), k);
  out.insert(out.end(), x.begin(), x.end());
  out.insert(out.end(), many.begin(), many.end());
  return out;
}

}  // namespace

TEST_CASE("the band factor reproduces its matrix within the stated bound, and solves it") {
  BandCholesky band(200, 80);
  for (const Size& size : sizes) {
    CAPTURE(size.n);
    CAPTURE(size.band);
    const Eigen::MatrixXd m = random_band(size, 1);
    fill(band, m, size.band);
    REQUIRE(band.factor(0, size.n));
    Eigen::MatrixXd l = Eigen::MatrixXd::Zero(size.n, size.n);
    for (int j = 0; j < size.n; ++j) {
      for (int i = j; i < std::min(size.n, j + size.band + 1); ++i) l(i, j) = band.entry(i, j);
    }
    const Eigen::MatrixXd bound = (size.band + 2) * eps * l.cwiseAbs() * l.cwiseAbs().transpose();
    CHECK(((l * l.transpose() - m).cwiseAbs().array() <= bound.array()).all());
    Eigen::VectorXd x = Eigen::VectorXd::LinSpaced(size.n, -1, 2);
    const Eigen::VectorXd truth = m.llt().solve(x);
    band.solve_lower({x.data(), static_cast<std::size_t>(size.n)}, 0, size.n);
    band.solve_upper({x.data(), static_cast<std::size_t>(size.n)}, 0, size.n);
    CHECK((x - truth).cwiseAbs().maxCoeff() < 1e-13);
  }
}

TEST_CASE("slices and vector units leave no trace in the band factor's bits") {
  for (const Size& size : sizes) {
    const Eigen::MatrixXd m = random_band(size, 2);
    BandCholesky portable(200, 80, Simd::portable);
    const std::vector<double> truth = all_numbers(portable, m, size.band, size.n);
    for (const Simd simd : every_simd) {
      if (!machine_has(simd)) continue;
      BandCholesky band(200, 80, simd);
      (void)all_numbers(band, random_band({200, 80}, 9), 80,
                        200);  // what lies between the columns is not clean any more
      for (const int slice : {size.n, 8, 3, 1}) {
        CAPTURE(to_string(simd));
        CAPTURE(size.n);
        CAPTURE(slice);
        const std::vector<double> numbers = all_numbers(band, m, size.band, slice);
        CHECK(std::memcmp(numbers.data(), truth.data(), truth.size() * sizeof(double)) == 0);
      }
    }
  }
}

TEST_CASE(
    "many right sides at once are what each of them would be alone, and the Gram blocks their products") {
  const Size size{133, 51};
  BandCholesky band(size.n, size.band);
  fill(band, random_band(size, 3), size.band);
  REQUIRE(band.factor(0, size.n));
  std::vector<double> many(24 * size.n, 0.0);
  for (int i = 40; i < size.n; ++i) {
    for (int s = 8; s < 24; ++s) many[24 * i + s] = std::cos(i * s);
  }
  std::vector<double> before = many;
  band.solve_lower_many(many, 24, 8, 16, 40,
                        size.n);  // rows above the first that is not zero may be left out
  for (int s = 0; s < 24; ++s) {
    std::vector<double> alone(size.n);
    for (int i = 0; i < size.n; ++i) alone[i] = before[24 * i + s];
    if (s >= 8) band.solve_lower(alone, 0, size.n);
    for (int i = 0; i < size.n; ++i) CHECK(std::abs(many[24 * i + s] - alone[i]) < 1e-15);
  }
  double block[64] = {};
  band.kernel().gram_block(many.data(), 24, 40, 90, 16, 8, block);
  band.kernel().gram_block(many.data(), 24, 90, size.n, 16, 8, block);
  for (int a = 0; a < 8; ++a) {
    for (int b = 0; b < 8; ++b) {
      double sum = 0;
      for (int i = 0; i < size.n; ++i) sum += many[24 * i + 16 + a] * many[24 * i + 8 + b];
      CHECK(block[8 * a + b] == doctest::Approx(sum).epsilon(1e-13));
    }
  }
}

TEST_CASE("a matrix that is not positive definite is refused at the column where it shows") {
  const Size size{60, 20};
  Eigen::MatrixXd m = random_band(size, 4);
  BandCholesky band(size.n, size.band);
  m(37, 37) = -1;
  fill(band, m, size.band);
  CHECK_FALSE(band.factor(0, size.n));
  CHECK(band.failed_column() == 37);
  m(37, 37) = NAN;
  fill(band, m, size.band);
  CHECK_FALSE(band.factor(0, size.n));
  CHECK(band.failed_column() == 37);
  m(37, 37) = 0.5 * size.band;  // smaller than its neighbours, and still enough
  m.row(37).head(37).setZero(), m.col(37).head(37).setZero();
  fill(band, m, size.band);
  REQUIRE(band.factor(0, size.n));
  CHECK(band.smallest_column() == 37);
  CHECK(band.smallest_pivot() == 0.5 * size.band);
}

TEST_CASE("the estimate of the inverse's norm lies between a third of it and it") {
  for (unsigned seed = 1; seed <= 20; ++seed) {
    const Size size{80, 12};
    Eigen::MatrixXd m = random_band(size, seed);
    m.diagonal().array() -= (0.4 + 0.02 * seed) * size.band;
    const Eigen::LLT<Eigen::MatrixXd> dense(m);
    if (dense.info() != Eigen::Success) continue;
    BandCholesky band(size.n, size.band);
    fill(band, m, size.band);
    REQUIRE(band.factor(0, size.n));
    const double truth = m.inverse().cwiseAbs().colwise().sum().maxCoeff(),
                 estimate = estimated_inverse_norm(band);
    CHECK(estimate <= truth * (1 + 1e-10));
    CHECK(estimate >= truth / 3);
  }
}

TEST_CASE("the band factor takes its memory when it is made") {
  BandCholesky band(133, 51);
  const Eigen::MatrixXd m = random_band({133, 51}, 5);
  const std::size_t before = test::allocations();
  fill(band, m, 51);
  const bool good = band.factor(0, 133);
  const std::size_t after = test::allocations();
  CHECK(good);
  CHECK(after == before);
  CHECK(band.bytes() >= 133 * 52 * sizeof(double));
}
