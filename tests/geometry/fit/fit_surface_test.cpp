#include "geometry/fit/fit_surface.hpp"

#include "geometry/fit/fit_points.hpp"

#include <doctest/doctest.h>

#include <cmath>

using namespace moldloft;
using namespace moldloft::geometry;

namespace {

double wave(double u, double v) { return 100 + 5 * std::sin(7 * u) * std::cos(5 * v) + 3 * u; }

constexpr FairingSettings no_fairing{.everywhere = 0, .where_sparse = 0};

double rms_error(const BSplineSurface& surface, auto&& inside) {
  double sum = 0, count = 0;
  for (int i = 0; i <= 120; ++i) {
    for (int j = 0; j <= 120; ++j) {
      const double u = i / 120.0, v = j / 120.0;
      if (!inside(u, v)) continue;
      const double e = surface.at(u, v).value.z() - wave(u, v);
      sum += e * e, count += 1;
    }
  }
  return std::sqrt(sum / count);
}

bool everywhere(double, double) { return true; }

}  // namespace

TEST_CASE("the fit of a point set is the dense QR solution: square and oblong nets, weighted or not") {
  const test::FitPoints points = test::fit_points(3000, 1, 0.3, wave);
  for (const auto& [nu, nv] : {std::pair{4, 4}, {9, 9}, {12, 6}, {5, 14}, {23, 4}}) {
    for (const bool weighted : {false, true}) {
      const auto fitted = fit_surface(weighted ? points.weighted() : points.columns(), {.control_u = nu,
                                                                                        .control_v = nv,
                                                                                        .fairing = no_fairing,
                                                                                        .residual_pass = true,
                                                                                        .condition = true});
      REQUIRE(fitted.has_value());
      const auto &ku = fitted->surface.knots_u, &kv = fitted->surface.knots_v;
      const Eigen::VectorXd dense = test::dense_solution(points, ku, kv, weighted);
      CAPTURE(nu);
      CAPTURE(nv);
      // Heights span 13: the bound of the header.
      CHECK(test::largest_difference(fitted->surface, dense) < 1e-11 * 13);
      double squares = 0, weight = 0, largest = 0;
      Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(dense.size(), dense.size());
      for (std::size_t i = 0; i < points.u.size(); ++i) {
        const Eigen::VectorXd row = test::basis_row(ku, kv, points.u[i], points.v[i]);
        const double r = points.z[i] - row.dot(dense), w = weighted ? points.w[i] : 1;
        squares += w * r * r, weight += w, largest = std::max(largest, std::abs(r));
        normal += w * row * row.transpose();
      }
      const FitReport& report = fitted->report;
      CHECK(report.rms_residual == doctest::Approx(std::sqrt(squares / weight)).epsilon(1e-9));
      CHECK(report.max_residual == doctest::Approx(largest).epsilon(1e-9));
      CHECK(report.totals.points == 3000);
      CHECK(report.freedom == nu * nv);
      const double condition = normal.cwiseAbs().colwise().sum().maxCoeff() *
                               normal.inverse().cwiseAbs().colwise().sum().maxCoeff();
      CHECK(report.condition <= condition * (1 + 1e-8));
      CHECK(report.condition >= condition / 3);
    }
  }
}

TEST_CASE("x and y of the surface are the columns' own coordinates") {
  test::FitPoints points = test::fit_points(2000, 2, 0, [](double u, double v) { return 2 * u - v; });
  for (double& u : points.u) u = 10 + 300 * u;
  for (double& v : points.v) v = -5 + 200 * v;
  const auto fitted =
      fit_surface(points.columns(), {.control_u = 8, .control_v = 6, .domain = {10, 310, -5, 195}});
  REQUIRE(fitted.has_value());
  for (const double u : {10.0, 77.0, 310.0}) {
    for (const double v : {-5.0, 99.0, 195.0}) {
      const Eigen::Vector3d p = fitted->surface.at(u, v).value;
      CHECK((p - Eigen::Vector3d(u, v, 2 * (u - 10) / 300 - (v + 5) / 200)).norm() < 1e-11);
    }
  }
}

TEST_CASE("uneven and repeated knots change nothing but the cells") {
  const test::FitPoints points = test::fit_points(4000, 3, 0.3, wave);
  const std::vector<double> ku{0, 0, 0, 0, 0.1, 0.15, 0.4, 0.4, 0.8, 1, 1, 1, 1};
  const std::vector<double> kv{0, 0, 0, 0, 0.3, 0.31, 0.5, 0.5, 0.5, 1, 1, 1, 1};
  for (const bool turned : {false, true}) {
    const auto &a = turned ? kv : ku, &b = turned ? ku : kv;
    const auto fitted = fit_surface(points.columns(), {.knots_u = a, .knots_v = b, .fairing = no_fairing});
    REQUIRE(fitted.has_value());
    CHECK(test::largest_difference(fitted->surface, test::dense_solution(points, a, b, false)) <
          1e-11 * 13 * 100);
  }
}

TEST_CASE("moments that threads or shots added up give the surface of one call") {
  const test::FitPoints points = test::fit_points(20'000, 4, 0.1, wave);
  const FitSettings settings{.control_u = 11, .control_v = 9};
  const auto whole = fit_surface(points.columns(), settings);
  auto first = accumulator_for(settings, points.z[0]), second = accumulator_for(settings, points.z[0]);
  REQUIRE(first->add(points.part(0, 9000)).has_value());
  // part() carries weights; without them:
  first->clear();
  REQUIRE(
      first->add({.u = {points.u.data(), 9000}, .v = {points.v.data(), 9000}, .z = {points.z.data(), 9000}})
          .has_value());
  REQUIRE(
      second
          ->add({.u = {&points.u[9000], 11000}, .v = {&points.v[9000], 11000}, .z = {&points.z[9000], 11000}})
          .has_value());
  first->merge(*second);
  const auto merged = fit_moments(*first, settings);
  REQUIRE(merged.has_value());
  CHECK((merged->surface.z - whole->surface.z).cwiseAbs().maxCoeff() < 1e-11);
}

TEST_CASE("the chosen net follows the data, and a stated tolerance coarsens it") {
  const test::FitPoints calm =
      test::fit_points(40'000, 5, 0.1, [](double u, double v) { return 3 * u * u * v + v; });
  const auto coarse = fit_surface(calm.columns(), {});
  REQUIRE(coarse.has_value());
  CHECK(coarse->surface.control_u() == 7);
  CHECK(coarse->report.sigma == doctest::Approx(0.1).epsilon(0.02));

  const test::FitPoints points = test::fit_points(40'000, 6, 0.05, wave);
  const auto fine = fit_surface(points.columns(), {}),
             bic = fit_surface(points.columns(), {.criterion = NetCriterion::bic}),
             loose = fit_surface(points.columns(), {.tolerance = 0.2});
  REQUIRE(fine.has_value());
  REQUIRE(loose.has_value());
  CHECK(fine->report.sigma == doctest::Approx(0.05).epsilon(0.02));
  CHECK(bic->surface.control_u() <= fine->surface.control_u());
  CHECK(loose->surface.control_u() < fine->surface.control_u());
  CHECK(rms_error(loose->surface, everywhere) < 0.2);
  // The theory of a net that can represent the truth: sigma sqrt(N / M); five deviations of a
  // chi-squared of N.
  const double n = static_cast<double>(fine->surface.z.size());
  CHECK(rms_error(fine->surface, everywhere) <
        0.05 * std::sqrt(n / 40'000) * (1 + 5 / std::sqrt(2 * n)) * 1.2);
}

TEST_CASE("a net between the nested ones has the moments of its own cells") {
  const test::FitPoints points = test::fit_points(5000, 7, 0.1, wave);
  const std::vector<int> at{0, 2, 5, 8};
  const std::vector<double> knots{0, 0, 0, 0, 0.25, 0.625, 1, 1, 1, 1};
  MomentAccumulator fine(8, 8), direct(SplineNet(knots, knots), 0);
  REQUIRE(fine.add(points.columns()).has_value());
  REQUIRE(direct.add(points.columns()).has_value());
  MomentGrid merged(3, 3);
  merged.merge_blocks(fine.grid(), at, at);
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      CHECK(merged.points(i, j) == direct.grid().points(i, j));
      const double size = direct.grid().cell(i, j).weight();
      for (std::size_t k = 0; k < 56; ++k) {
        const double scale = k % 8 == 7 ? 1e4 : 1;  // squares of heights of 100
        CHECK(std::abs(merged.cell(i, j).gram[k] - direct.grid().cell(i, j).gram[k]) < 1e-12 * size * scale);
      }
      for (std::size_t k = 0; k < 16; ++k) {
        CHECK(std::abs(merged.cell(i, j).load[k] - direct.grid().cell(i, j).load[k]) < 1e-12 * size * 100);
      }
    }
  }
}

TEST_CASE("a hole is filled smoothly, and the surface outside does not feel it") {
  test::FitPoints points = test::fit_points(60'000, 8, 0.02, wave);
  const auto in_hole = [](double u, double v) { return std::hypot(u - 0.52, v - 0.47) < 0.13; };
  test::FitPoints holed;
  for (std::size_t i = 0; i < points.u.size(); ++i) {
    if (in_hole(points.u[i], points.v[i])) continue;
    holed.u.push_back(points.u[i]), holed.v.push_back(points.v[i]), holed.z.push_back(points.z[i]);
  }
  const auto far = [&](double u, double v) { return std::hypot(u - 0.52, v - 0.47) > 0.16; };
  const auto whole = fit_surface(points.columns(), {.control_u = 23, .control_v = 23});
  const auto fitted = fit_surface(holed.columns(), {.control_u = 23, .control_v = 23});
  REQUIRE(fitted.has_value());
  CHECK(fitted->report.empty_cells > 5);
  // What a thin plate held at the rim of a disk of radius R misses of a height with biharmonic q: q R^4 /
  // 64 in the middle, that over sqrt(5) rms; the rim is a cell wide, and q at most (7^2 + 5^2)^2 times 5.
  CHECK(rms_error(fitted->surface, in_hole) < 74 * 74 * 5 * std::pow(0.13 + 0.05, 4) / 64 / std::sqrt(5.0));
  CHECK(rms_error(fitted->surface, far) < 1.05 * rms_error(whole->surface, far));
  // The residual is that of the points, without the fairing's energy.
  double squares = 0;
  for (std::size_t i = 0; i < holed.u.size(); ++i) {
    squares += std::pow(holed.z[i] - fitted->surface.at(holed.u[i], holed.v[i]).value.z(), 2);
  }
  const double points_held = static_cast<double>(holed.u.size());
  CHECK(fitted->report.rms_residual == doctest::Approx(std::sqrt(squares / points_held)).epsilon(1e-9));
  // Without fairing it is an error that names a cell without points.
  const auto refused =
      fit_surface(holed.columns(), {.control_u = 23, .control_v = 23, .fairing = no_fairing});
  REQUIRE_FALSE(refused.has_value());
  CHECK(refused.error().error == Error::empty_cells);
  const double cell_u = (static_cast<double>(refused.error().where / 20) + 0.5) / 20,
               cell_v = (static_cast<double>(refused.error().where % 20) + 0.5) / 20;
  CHECK(in_hole(cell_u, cell_v));
}

TEST_CASE("one outlier in a hundred loses its pull by Tukey's weights, on a given net and on a chosen one") {
  test::FitPoints points = test::fit_points(60'000, 9, 0.02, wave);
  const auto clean = fit_surface(points.columns(), {.control_u = 15, .control_v = 15});
  for (std::size_t i = 0; i < points.z.size(); i += 100) points.z[i] += i % 200 == 0 ? 3 : -3;
  const auto plain = fit_surface(points.columns(), {.control_u = 15, .control_v = 15});
  const auto robust = fit_surface(points.columns(), {.control_u = 15, .control_v = 15, .robust_passes = 10});
  const auto chosen = fit_surface(points.columns(), {.robust_passes = 10});
  REQUIRE(robust.has_value());
  REQUIRE(chosen.has_value());
  CHECK(rms_error(plain->surface, everywhere) > 3 * rms_error(clean->surface, everywhere));
  // Tukey's weights cost 5 % of efficiency, that is 2.5 % of rms; the lost points 0.5 %; the rest is chance.
  CHECK(rms_error(robust->surface, everywhere) < 1.15 * rms_error(clean->surface, everywhere));
  CHECK(rms_error(chosen->surface, everywhere) < 1.5 * rms_error(clean->surface, everywhere));
  CHECK(robust->report.robust_sigma == doctest::Approx(0.02).epsilon(0.03));
  CHECK(robust->report.robust_passes < 10);
}

TEST_CASE("a given boundary is met exactly, or as closely as its weight asks") {
  const test::FitPoints points = test::fit_points(5000, 10, 0.1, wave);
  const auto free = fit_surface(points.columns(), {.control_u = 9, .control_v = 7, .fairing = no_fairing});
  Eigen::MatrixXd ring = Eigen::MatrixXd::Constant(9, 7, NAN);  // the inside is not looked at
  for (int i = 0; i < 9; ++i) {
    for (int j = 0; j < 7; ++j) {
      if (i == 0 || j == 0 || i == 8 || j == 6) ring(i, j) = 101 + 0.1 * i - 0.2 * j;
    }
  }
  FitSettings settings{.control_u = 9, .control_v = 7, .fairing = no_fairing};
  settings.boundary.control = ring;
  const auto fixed = fit_surface(points.columns(), settings);
  REQUIRE(fixed.has_value());
  // The definition: the ring's columns moved to the right side of the dense problem (thesis eq. 3.40, 3.41).
  const auto rows = static_cast<Eigen::Index>(points.u.size());
  Eigen::MatrixXd a(rows, 35);
  Eigen::VectorXd b(rows);
  for (Eigen::Index r = 0; r < rows; ++r) {
    const auto k = static_cast<std::size_t>(r);
    const Eigen::VectorXd row =
        test::basis_row(fixed->surface.knots_u, fixed->surface.knots_v, points.u[k], points.v[k]);
    b[r] = points.z[k];
    for (int i = 0, inner = 0; i < 9; ++i) {
      for (int j = 0; j < 7; ++j) {
        if (std::isnan(ring(i, j))) {
          a(r, inner++) = row[i * 7 + j];
        } else {
          b[r] -= row[i * 7 + j] * ring(i, j);
        }
      }
    }
  }
  const Eigen::VectorXd dense = a.householderQr().solve(b);
  double inside = 0, on_ring = 0;
  for (int i = 0, k = 0; i < 9; ++i) {
    for (int j = 0; j < 7; ++j) {
      double& worst = std::isnan(ring(i, j)) ? inside : on_ring;
      worst = std::max(worst,
                       std::abs(fixed->surface.z(i, j) - (std::isnan(ring(i, j)) ? dense[k++] : ring(i, j))));
    }
  }
  CHECK(inside < 1e-10);
  CHECK(on_ring < 1e-12);
  CHECK(fixed->report.rms_residual ==
        doctest::Approx(std::sqrt((a * dense - b).squaredNorm() / 5000)).epsilon(1e-9));
  CHECK(fixed->report.freedom == 35);

  settings.boundary.weight = 1e-9;
  CHECK((fit_surface(points.columns(), settings)->surface.z - free->surface.z).cwiseAbs().maxCoeff() < 1e-6);
  settings.boundary.weight = 1e9;
  const auto tight = fit_surface(points.columns(), settings);
  CHECK((tight->surface.z - fixed->surface.z).cwiseAbs().maxCoeff() < 1e-5);
  CHECK(tight->report.rms_residual == doctest::Approx(fixed->report.rms_residual).epsilon(1e-5));
}

TEST_CASE("what cannot be fitted is named with its place") {
  test::FitPoints points = test::fit_points(2000, 11, 0.1, wave);
  const FitSettings settings{.control_u = 8, .control_v = 8, .fairing = no_fairing};
  CHECK(fit_surface({}, settings).error().error == Error::too_few_points);
  const test::FitPoints few = test::fit_points(63, 12, 0.1, wave);
  CHECK(fit_surface(few.columns(), settings).error() == Flaw{Error::too_few_points, 63});
  CHECK(fit_surface(few.columns(), {}).error().error == Error::too_few_points);
  points.z[1234] = NAN;
  CHECK(fit_surface(points.columns(), settings).error() == Flaw{Error::not_finite, 1234});
  points.z[1234] = 1, points.u[77] = 1.5;
  CHECK(fit_surface(points.columns(), settings).error() == Flaw{Error::outside_domain, 77});
  CHECK(fit_surface(points.columns(),
                    {.knots_u = {0, 0, 0, 0, 0.7, 0.5, 1, 1, 1, 1}, .knots_v = {0, 0, 0, 0, 1, 1, 1, 1}})
            .error() == Flaw{Error::knots_not_increasing, 5});
  CHECK(fit_surface(points.columns(), {.domain = {0, 0, 0, 1}}).error().error == Error::no_extent);

  // Every cell has points, but those of the last row of cells lie where it begins: nothing holds the last
  // row of control points, whose functions are zero there.
  test::FitPoints lines;
  for (int i = 0; i < 40; ++i) {
    for (int j = 0; j < 40; ++j) {
      lines.u.push_back(i < 32 ? i / 40.0 : 0.8), lines.v.push_back((j + 0.5) / 40), lines.z.push_back(j % 3);
    }
  }
  const auto singular = fit_surface(lines.columns(), settings);
  REQUIRE_FALSE(singular.has_value());
  CHECK(singular.error().error == Error::singular);
  CHECK(singular.error().where / 8 == 7);
}

TEST_CASE("a fit on 23 x 23 holds less than a mebibyte above its points, whatever their number") {
  std::size_t bytes[2];
  for (const int size : {5000, 50'000}) {
    const test::FitPoints points = test::fit_points(size, 13, 0.1, wave);
    bytes[size == 5000] = fit_surface(points.columns(), {.control_u = 23, .control_v = 23})->report.bytes;
  }
  CHECK(bytes[0] == bytes[1]);
  CHECK(bytes[0] <= 1024 * 1024);
}

TEST_CASE("a net is chosen from 16 to 5,000 points, smooth and wavy, scattered and gridded, in any order") {
  const auto smooth = [](double u, double v) { return 20 * u * u - 10 * u * v + v; };
  const auto wavy = [](double u, double v) { return 5 * std::sin(25 * u) * std::cos(21 * v); };
  for (const int size :
       {16, 100, 195, 196, 225, 256, 300, 400, 483, 484, 700, 1000, 1169, 2025, 3000, 4900, 5000}) {
    for (const bool waves : {false, true}) {
      for (const int order : {0, 1, 2}) {  // scattered, gridded along u, along v
        test::FitPoints points =
            test::fit_points(size, static_cast<unsigned>(size), 0.01,
                             [&](double u, double v) { return waves ? wavy(u, v) : smooth(u, v); });
        const int side = static_cast<int>(std::sqrt(size));
        for (int k = 0; order > 0 && k < side * side; ++k) {
          const auto at = static_cast<std::size_t>(k);
          points.u[at] = (order == 1 ? k / side : k % side) / (side - 1.0);
          points.v[at] = (order == 1 ? k % side : k / side) / (side - 1.0);
          points.z[at] = waves ? wavy(points.u[at], points.v[at]) : smooth(points.u[at], points.v[at]);
        }
        CAPTURE(size);
        CAPTURE(waves);
        CAPTURE(order);
        const auto fitted = fit_surface(points.columns(), {.residual_pass = true, .condition = true});
        if (size < 196) {
          CHECK(fitted.error() == Flaw{Error::too_few_points, static_cast<std::uint64_t>(size)});
          continue;
        }
        REQUIRE(fitted.has_value());
        double squares = 0, largest = 0;
        for (std::size_t i = 0; i < points.u.size(); ++i) {
          const double off = points.z[i] - fitted->surface.at(points.u[i], points.v[i]).value.z();
          squares += off * off, largest = std::max(largest, std::abs(off));
        }
        // 1e-11 of the heights' range in the coefficients, and sums of squares that lose half of their digits.
        CHECK(std::abs(fitted->report.rms_residual - std::sqrt(squares / size)) < 1e-6);
        CHECK(std::abs(fitted->report.max_residual - largest) < 1e-9);
        CHECK(fitted->report.condition >= 1);
        if (!waves) CHECK(largest < 0.1);
      }
    }
  }
}

TEST_CASE("a solver refuses a net that is larger than it was built for") {
  const SplineNet large(8, 8);
  const MomentGrid moments(8, 8);
  NetTask task;
  task.net = &large, task.moments = &moments;
  NetSolver solver(static_cast<std::size_t>(SplineNet(4, 4).unknowns()), 24);
  CHECK(!solver.holds(large));
  solver.start(task, nullptr);
  CHECK(solver.solve().error() == Error::capacity);
}

TEST_CASE("numbers no double can square, points on a line and settings without sense are refused by name") {
  test::FitPoints points = test::fit_points(400, 14, 0.1, wave);
  const auto error = [&](const FitSettings& settings) {
    const auto fitted = fit_surface(points.columns(), settings);
    REQUIRE(!fitted);
    return fitted.error();
  };
  const double good = points.z[123];
  for (const std::size_t at : {std::size_t{0}, std::size_t{123}}) {
    const double kept = points.z[at];
    for (const double large : {1e300, -1e200, 1e308}) {
      points.z[at] = large;
      CHECK(error({}) == Flaw{Error::too_large, at});
      CHECK(error({.control_u = 6, .control_v = 6}) == Flaw{Error::too_large, at});
    }
    points.z[at] = kept;
  }
  points.z[123] = 1e100;  // nothing that one would measure, yet a number
  CHECK(std::isfinite(fit_surface(points.columns(), {})->report.rms_residual));
  points.z[123] = good;

  for (const double bad : {-1.0, static_cast<double>(NAN)}) {
    CHECK(error({.tolerance = bad}).error == Error::impossible_setting);
    CHECK(error({.fairing = {.everywhere = bad}}).error == Error::impossible_setting);
  }
  CHECK(error({.control_u = 3, .control_v = 8}).error == Error::impossible_setting);
  CHECK(error({.control_u = 8}).error == Error::impossible_setting);
  CHECK(error({.control_u = -8, .control_v = -8}).error == Error::impossible_setting);
  CHECK(error({.control_u = 1'000'000, .control_v = 1'000'000}).error == Error::capacity);
  CHECK(error({.finest_spans = 5}).error == Error::impossible_setting);
  CHECK(error({.finest_spans = 0}).error == Error::impossible_setting);
  CHECK(error({.knots_u = {0, 0, 0, 0, 1, 1, 1, 1}}).error == Error::knots_wrong_count);
  CHECK(error({.control_u = 6, .control_v = 6, .boundary = {.control = Eigen::MatrixXd::Zero(6, 7)}}).error ==
        Error::sizes_differ);
  CHECK(error({.domain = {0, NAN, 0, 1}}).error == Error::not_finite);
  CHECK(error({.domain = {1, 0, 0, 1}}).error == Error::no_extent);
  CHECK(error({.domain = {0, 1e-303, 0, 1}}).error == Error::no_extent);
  const std::vector<double> short_column(399);
  CHECK(fit_surface({.u = points.u, .v = short_column, .z = points.z}, {}).error().error ==
        Error::sizes_differ);
  CHECK(
      fit_surface({.u = points.u, .v = points.v, .z = points.z, .weight = short_column}, {}).error().error ==
      Error::sizes_differ);
  CHECK(fit_moments(MomentAccumulator(8, 8), {.control_u = 6, .control_v = 6}).error().error ==
        Error::sizes_differ);
  CHECK(fit_moments(MomentAccumulator(8, 8), {.finest_spans = 16}).error().error == Error::sizes_differ);
  const std::vector<double> nothing(400, 0.0);
  CHECK(fit_surface({.u = points.u, .v = points.v, .z = points.z, .weight = nothing}, {}).error().error ==
        Error::too_few_points);

  for (std::size_t i = 0; i < 400; ++i) points.v[i] = 0.25 + 0.5 * points.u[i];
  CHECK(error({}).error == Error::collinear);
  CHECK(error({.control_u = 6, .control_v = 6}).error == Error::collinear);
  for (std::size_t i = 0; i < 400; ++i) points.u[i] = points.v[i] = 0.3;
  CHECK(error({}).error == Error::collinear);
}

TEST_CASE("the surface does not depend on where the origin lies nor on the unit of length") {
  const test::FitPoints points = test::fit_points(1000, 15, 0.01, wave);
  const auto here = fit_surface(points.columns(), {});
  REQUIRE(here);
  for (const double scale : {1e-3, 1.0, 1e6}) {
    for (const double origin : {0.0, 1e6 * scale, -3e7 * scale}) {
      test::FitPoints moved = points;
      for (std::size_t i = 0; i < 1000; ++i) {
        moved.u[i] = origin + scale * points.u[i], moved.v[i] = scale * points.v[i] - origin;
        moved.z[i] = origin + scale * points.z[i];
      }
      const auto there =
          fit_surface(moved.columns(), {.domain = {origin, origin + scale, -origin, scale - origin}});
      REQUIRE(there);
      REQUIRE(there->surface.control_u() == here->surface.control_u());
      // Coordinates of 3e7 keep 4e-9 of the unit square, on slopes of 35; coefficients may carry some of that on.
      const double off =
          ((there->surface.z.array() - origin) / scale - here->surface.z.array()).abs().maxCoeff();
      CHECK(off < (origin == 0 ? 1e-9 : 1e-5));
    }
  }
}

TEST_CASE("robust passes over heights that are met exactly leave them as they are") {
  test::FitPoints points = test::fit_points(400, 16, 0, [](double u, double v) { return 2 * u - v; });
  const auto fitted = fit_surface(points.columns(), {.robust_passes = 5});
  REQUIRE(fitted);
  CHECK(fitted->report.rms_residual < 1e-7);
  for (double& z : points.z) z = 7;
  const auto level = fit_surface(points.columns(), {.robust_passes = 5});
  REQUIRE(level);
  CHECK((level->surface.z.array() - 7).abs().maxCoeff() < 1e-12);
}
