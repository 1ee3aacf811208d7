#include "geometry/fit/moment_kernel.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <random>
#include <vector>

using namespace moldloft::geometry;

namespace {

constexpr Simd every_simd[] = {Simd::portable, Simd::avx2, Simd::avx512};

struct Points {
  std::vector<double> u, v, z, w;
};

// Stripes that cross cells, then points in no order.
Points some_points(int count, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> unit(0, 1);
  Points p;
  for (int i = 0; i < count; ++i) {
    const bool stripe = i < count / 2;
    p.u.push_back(stripe ? std::fmod(i * 0.0007, 1.0) : unit(random));
    p.v.push_back(stripe ? std::fmod(i * 0.0031 + 0.1 * p.u.back(), 1.0) : unit(random));
    p.z.push_back(20 * unit(random) - 10);
    p.w.push_back(2 * unit(random));
  }
  p.u[3] = 0, p.v[3] = 1, p.u[4] = 1, p.v[4] = 0, p.u[5] = 0.25, p.v[5] = 0.5;
  return p;
}

struct Folded {
  std::vector<CellMoments> cells;
  std::vector<std::uint32_t> counts;
  std::vector<double> shot, heights;
};

constexpr int cells_u = 5, cells_v = 7;

Folded fold(Simd simd, const Points& p, bool weighted, int block_size) {
  const MomentKernel& kernel = moment_kernel(simd);
  Folded out{std::vector<CellMoments>(cells_u * cells_v),
             std::vector<std::uint32_t>(cells_u * cells_v),
             std::vector<double>(16),
             {}};
  std::vector<std::array<double, 16>> bezier(cells_u * cells_v);
  for (std::size_t c = 0; c < bezier.size(); ++c) {
    for (std::size_t k = 0; k < 16; ++k) bezier[c][k] = std::sin(1.0 + static_cast<double>(c * 16 + k));
  }
  static PointBlock block;
  const int points = static_cast<int>(p.u.size());
  for (int first = 0; first < points; first += block_size) {
    block.count = std::min(block_size, points - first);
    block.weighted = weighted, block.shot_rows_wanted = true;
    std::copy_n(&p.z[first], block.count, block.height);
    std::copy_n(&p.w[first], block.count, block.weight);
    REQUIRE(kernel.locate(block, &p.u[first], &p.v[first], {cells_u, cells_v, cells_u, cells_v, 0, 0}));
    kernel.values(block);
    kernel.fold(block, out.cells.data(), out.counts.data());
    double height[PointBlock::capacity];
    kernel.heights(block, bezier.data(), height);
    out.heights.insert(out.heights.end(), height, height + block.count);
    for (int k = 0; k < block.count; ++k) kernel.fold_shot(block, k, k + 1, out.shot.data());
  }
  return out;
}

bool same_bits(const void* a, const void* b, std::size_t bytes) { return std::memcmp(a, b, bytes) == 0; }

bool same(const Folded& a, const Folded& b) {
  return same_bits(a.cells.data(), b.cells.data(), a.cells.size() * sizeof(CellMoments)) &&
         a.counts == b.counts && same_bits(a.shot.data(), b.shot.data(), 16 * sizeof(double)) &&
         same_bits(a.heights.data(), b.heights.data(), a.heights.size() * sizeof(double));
}

// The definition, in the order of the points.
std::vector<CellMoments> plain(const Points& p, bool weighted) {
  std::vector<CellMoments> cells(cells_u * cells_v);
  for (std::size_t i = 0; i < p.u.size(); ++i) {
    const int a = std::min(static_cast<int>(p.u[i] * cells_u), cells_u - 1);
    const int b = std::min(static_cast<int>(p.v[i] * cells_v), cells_v - 1);
    cells[a * cells_v + b].add(bernstein(p.u[i] * cells_u - a), bernstein(p.v[i] * cells_v - b), p.z[i],
                               weighted ? p.w[i] : 1);
  }
  return cells;
}

}  // namespace

TEST_CASE(
    "every variant of the moment kernel gives the bits of the plain sums, however the points are cut into "
    "blocks") {
  const Points points = some_points(4001, 1);
  for (const bool weighted : {false, true}) {
    const std::vector<CellMoments> truth = plain(points, weighted);
    const Folded portable = fold(Simd::portable, points, weighted, 128);
    CHECK(same_bits(truth.data(), portable.cells.data(), truth.size() * sizeof(CellMoments)));
    for (const Simd simd : every_simd) {
      if (!machine_has(simd)) continue;
      CAPTURE(to_string(simd));
      for (const int block : {128, 127, 64, 9, 1}) CHECK(same(portable, fold(simd, points, weighted, block)));
    }
  }
}

TEST_CASE("a weight of one is no weight, and the eighth sum of the rows is the sum of squares") {
  Points points = some_points(1000, 2);
  std::ranges::fill(points.w, 1.0);
  CHECK(same(fold(Simd::portable, points, false, 128), fold(Simd::portable, points, true, 128)));
  double squares = 0, sum = 0, count = 0;
  for (const double z : points.z) squares += z * z;
  for (const CellMoments& cell : fold(Simd::portable, points, false, 128).cells) {
    sum += cell.squares(), count += cell.weight();
  }
  CHECK(sum == doctest::Approx(squares).epsilon(1e-13));
  CHECK(count == doctest::Approx(1000).epsilon(1e-13));
}

TEST_CASE("the surface at the points is the Bernstein sum of their cells") {
  const Points points = some_points(500, 3);
  const Folded folded = fold(widest_simd(), points, false, 128);
  for (std::size_t i = 0; i < points.u.size(); ++i) {
    const int a = std::min(static_cast<int>(points.u[i] * cells_u), cells_u - 1);
    const int b = std::min(static_cast<int>(points.v[i] * cells_v), cells_v - 1);
    const BernsteinValues s = bernstein(points.u[i] * cells_u - a), t = bernstein(points.v[i] * cells_v - b);
    double sum = 0;
    for (int p = 0; p < 4; ++p) {
      for (int q = 0; q < 4; ++q)
        sum += s.cubic[p] * t.cubic[q] * std::sin(1.0 + (a * cells_v + b) * 16 + p * 4 + q);
    }
    CHECK(std::abs(folded.heights[i] - sum) < 1e-14);
  }
}

TEST_CASE("points outside the grid or not finite are told, and touch no memory that is not theirs") {
  for (const Simd simd : every_simd) {
    if (!machine_has(simd)) continue;
    static PointBlock block;
    block.weighted = true;
    const auto located = [&](double u, double v, double z, double w) {
      std::vector<double> us(13, 0.5), vs(13, 0.5);
      block.count = 13;
      std::fill_n(block.height, 13, 1.0), std::fill_n(block.weight, 13, 1.0);
      us[11] = u, vs[11] = v, block.height[11] = z, block.weight[11] = w;
      const bool good = moment_kernel(simd).locate(block, us.data(), vs.data(), {4, 4, 4, 4, 0, 0});
      CHECK(block.cell[11] >= 0);
      CHECK(block.cell[11] < 16);
      return good;
    };
    CHECK(located(0, 1, -5, 0));
    CHECK_FALSE(located(-1e-9, 0.5, 1, 1));
    CHECK_FALSE(located(0.5, 1.0000001, 1, 1));
    CHECK_FALSE(located(1e300, 0.5, 1, 1));
    CHECK_FALSE(located(NAN, 0.5, 1, 1));
    CHECK_FALSE(located(0.5, 0.5, INFINITY, 1));
    CHECK_FALSE(located(0.5, 0.5, 1, -1));
    CHECK_FALSE(located(0.5, 0.5, 1, NAN));
  }
}

TEST_CASE(
    "merging halves gives the moments that the points would have had in the larger cell, bit for bit on "
    "every variant") {
  std::mt19937 random(4);
  std::uniform_real_distribution<double> unit(0, 1);
  for (const bool halve_u : {true, false}) {
    for (const bool halve_v : {true, false}) {
      CellMoments halves[4] = {}, truth{};
      for (int i = 0; i < 300; ++i) {
        const double u = unit(random), v = unit(random), z = unit(random);
        truth.add(bernstein(u), bernstein(v), z, 1.5);
        const int a = halve_u && u >= 0.5, b = halve_v && v >= 0.5;
        halves[2 * a + b].add(bernstein(halve_u ? 2 * u - a : u), bernstein(halve_v ? 2 * v - b : v), z, 1.5);
      }
      const CellMoments* const in[4] = {&halves[0], halve_v ? &halves[1] : nullptr,
                                        halve_u ? &halves[2] : nullptr,
                                        halve_u && halve_v ? &halves[3] : nullptr};
      CellMoments first;
      moment_kernel(Simd::portable).merge(in, first);
      // Sums of 300 nonnegative terms, each good to some eps: 300 eps is generous, 1e-12 of the
      // largest more so.
      for (std::size_t k = 0; k < 56; ++k)
        CHECK(first.gram[k] == doctest::Approx(truth.gram[k]).epsilon(1e-12));
      for (std::size_t k = 0; k < 16; ++k)
        CHECK(first.load[k] == doctest::Approx(truth.load[k]).epsilon(1e-12));
      for (const Simd simd : every_simd) {
        if (!machine_has(simd)) continue;
        CellMoments other;
        moment_kernel(simd).merge(in, other);
        CHECK(same_bits(&first, &other, sizeof first));
      }
    }
  }
}
