#include "geometry/inspection/least_distance.hpp"

#include "geometry/heap_watch.hpp"

#include <Eigen/QR>
#include <doctest/doctest.h>

#include <random>
#include <vector>

using namespace moldloft::geometry;
using namespace moldloft::test;

namespace {

struct Problem {
  std::vector<std::array<double, 6>> rows;
  std::vector<double> bounds;

  double largest_bound() const {
    double largest = 0;
    for (const double h : bounds) largest = std::max(largest, std::abs(h));
    return largest;
  }
  double broken_at(const Eigen::VectorXd& z) const {
    double most = 0;
    for (std::size_t i = 0; i < rows.size(); ++i) {
      double product = 0;
      for (int k = 0; k < z.size(); ++k) product += rows[i][static_cast<std::size_t>(k)] * z[k];
      most = std::max(most, bounds[i] - product);
    }
    return most;
  }
};

// With `inside` every row holds at a point 3 away from the origin, so that there is a solution.
Problem random_problem(std::mt19937& random, int unknowns, int count, bool inside) {
  std::normal_distribution<double> number;
  Problem problem;
  for (int i = 0; i < count; ++i) {
    std::array<double, 6> row{};
    for (int k = 0; k < unknowns; ++k) row[static_cast<std::size_t>(k)] = number(random);
    problem.rows.push_back(row);
    problem.bounds.push_back(inside ? 3 * row[1] - std::abs(number(random)) : number(random));
  }
  return problem;
}

// The shortest point on the planes of every subset of at most `unknowns` rows; the best that breaks nothing.
// The solution of the program is among them.
double shortest_by_enumeration(const Problem& problem, int unknowns) {
  const int count = static_cast<int>(problem.rows.size());
  double best = std::numeric_limits<double>::infinity();
  for (unsigned subset = 0; subset < (1U << count); ++subset) {
    std::vector<int> chosen;
    for (int i = 0; i < count; ++i) {
      if (subset >> i & 1U) chosen.push_back(i);
    }
    if (static_cast<int>(chosen.size()) > unknowns) continue;
    Eigen::VectorXd z = Eigen::VectorXd::Zero(unknowns);
    if (!chosen.empty()) {
      Eigen::MatrixXd g(chosen.size(), unknowns);
      Eigen::VectorXd h(chosen.size());
      for (Eigen::Index r = 0; r < g.rows(); ++r) {
        const auto i = static_cast<std::size_t>(chosen[static_cast<std::size_t>(r)]);
        for (int k = 0; k < unknowns; ++k) g(r, k) = problem.rows[i][static_cast<std::size_t>(k)];
        h[r] = problem.bounds[i];
      }
      z = g.completeOrthogonalDecomposition().solve(h);
    }
    if (problem.broken_at(z) < 1e-9) best = std::min(best, z.norm());
  }
  return best;
}

}  // namespace

TEST_CASE("the least distance is the best over every choice of contacts") {
  std::mt19937 random(1);
  for (int trial = 0; trial < 150; ++trial) {
    const int unknowns = 2 + trial % 3;
    const Problem problem = random_problem(random, unknowns, 9, trial % 2 == 0);
    const auto least = least_distance(problem.rows, problem.bounds);
    const double shortest = shortest_by_enumeration(problem, unknowns);
    REQUIRE(least.has_value() == std::isfinite(shortest));
    if (!least) continue;
    CHECK(std::abs(least->z.norm() - shortest) < 1e-9);
    CHECK(problem.broken_at(least->z) < 1e-11 * std::max(problem.largest_bound(), least->z.norm()));
  }
}

TEST_CASE("the contacts carry the least distance, and none of them pulls") {
  std::mt19937 random(2);
  for (int trial = 0; trial < 100; ++trial) {
    const Problem problem = random_problem(random, 6, 400, true);
    const auto least = least_distance(problem.rows, problem.bounds);
    REQUIRE(least);
    Vector6 carried = Vector6::Zero();
    for (int k = 0; k < least->active_count; ++k) {
      const ActiveRow& active = least->active[static_cast<std::size_t>(k)];
      CHECK(active.multiplier >= 0);
      const Vector6 row = Vector6::Map(problem.rows[active.row].data());
      carried += active.multiplier * row;
      CHECK(std::abs(row.dot(least->z) - problem.bounds[active.row]) < 1e-10);
    }
    CHECK((carried - least->z).norm() < 1e-10);
    CHECK(problem.broken_at(least->z) < 1e-11 * std::max(problem.largest_bound(), least->z.norm()));
  }
}

TEST_CASE("nothing moves where no constraint asks for it") {
  const std::vector<std::array<double, 6>> rows{{1, 0, 0, 0, 0, 0}, {0, 1, 0, 0, 0, 0}};
  const auto least = least_distance(rows, std::vector<double>{-1, -0.5});
  REQUIRE(least);
  CHECK(least->z.norm() == 0);
  CHECK(least->active_count == 0);
}

TEST_CASE("constraints that contradict one another have no least distance") {
  const std::vector<std::array<double, 6>> rows{{1, 0, 0, 0, 0, 0}, {-1, 0, 0, 0, 0, 0}, {0, 1, 0, 0, 0, 0}};
  CHECK(!least_distance(rows, std::vector<double>{1, -0.999, 0}));
  CHECK(least_distance(rows, std::vector<double>{1, -1.001, 0}));
  // Left out, the offender does not matter.
  CHECK(least_distance(rows, std::vector<double>{1, -0.999, 0}, std::vector<std::uint8_t>{1, 0, 1}));
}

TEST_CASE("the same constraint many times over is one contact") {
  std::vector<std::array<double, 6>> rows(50, {0.6, 0.8, 0, 0, 0, 0});
  const auto least = least_distance(rows, std::vector<double>(50, 5.0));
  REQUIRE(least);
  CHECK(std::abs(least->z[0] - 3) < 1e-12);
  CHECK(std::abs(least->z[1] - 4) < 1e-12);
}

TEST_CASE("a least distance takes no memory") {
  std::mt19937 random(3);
  const Problem problem = random_problem(random, 6, 200, true);
  const std::size_t before = allocations();
  const auto least = least_distance(problem.rows, problem.bounds);
  CHECK(allocations() == before);
  CHECK(least);
}
