#include "geometry/inspection/deviation.hpp"

#include "geometry/heap_watch.hpp"
#include "geometry/inspection/known_surfaces.hpp"
#include "geometry/inspection/localization.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <limits>

using namespace moldloft::geometry;
using namespace moldloft::test;

namespace {

struct Known {
  std::vector<Vector3d> points;
  std::vector<double> mm;
};

// Points at known distances along the normals, row by row as a scan would take them.
Known offset_points(const BSplineSurface& surface, int rows, double most_mm) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> off(-most_mm, most_mm);
  Known known;
  for (int i = 0; i < rows; ++i) {
    for (int j = 0; j < rows; ++j) {
      const SurfacePoint r = surface.at((i + 0.5) / rows, (j + 0.5) / rows);
      const double d = off(random);
      known.points.push_back(r.value + d * r.normal());
      known.mm.push_back(d);
    }
  }
  return known;
}

}  // namespace

TEST_CASE("deviations are the distances along the normals, in the order of a scan and in any other") {
  const RigidMotion upright = motion_about({0, 0, 0}, 90, {1, 0, 0}, {0, 0, 0});
  for (const BSplineSurface& surface : {yard_plate(), moved(upright, yard_plate())}) {
    const auto prepared = PreparedSurface::from(surface);
    Known known = offset_points(surface, 40, 20);
    for (const bool shuffled : {false, true}) {
      if (shuffled) {
        std::mt19937 random(2);
        for (std::size_t i = known.points.size() - 1; i > 0; --i) {
          const std::size_t j = random() % (i + 1);
          std::swap(known.points[i], known.points[j]);
          std::swap(known.mm[i], known.mm[j]);
        }
      }
      std::vector<Deviation> out(known.points.size());
      REQUIRE(measure_deviations(*prepared, known.points, {}, out));
      double worst = 0;
      for (std::size_t i = 0; i < out.size(); ++i) {
        worst = std::max(worst, std::abs(out[i].mm - known.mm[i]));
        CHECK(!out[i].beyond_border);
      }
      CHECK(worst < 1e-11);
    }
  }
}

TEST_CASE("material above the design is positive, and turning the parameters round turns the sign") {
  BSplineSurface surface = plate(4, 100, [](double, double) { return 0.0; });
  const std::vector<Vector3d> above{{50, 50, 2}};
  std::vector<Deviation> out(1);
  REQUIRE(measure_deviations(*PreparedSurface::from(surface), above, {}, out));
  CHECK(std::abs(out[0].mm - 2) < 1e-13);
  for (Eigen::MatrixXd* net : {&surface.x, &surface.y, &surface.z}) net->transposeInPlace();
  REQUIRE(measure_deviations(*PreparedSurface::from(surface), above, {}, out));
  CHECK(std::abs(out[0].mm + 2) < 1e-13);
}

TEST_CASE("points beyond the border are classed apart, those within the tolerance are not") {
  const auto flat = PreparedSurface::from(plate(4, 100, [](double, double) { return 0.0; }));
  const std::vector<Vector3d> points{{50, 50, 1}, {100.4, 50, 2}, {100.6, 50, 3}, {-3, -4, 5}, {100, 20, 6}};
  std::vector<Deviation> out(5);
  REQUIRE(measure_deviations(*flat, points, {}, out));
  CHECK(out[0].place == FootPlace::interior);
  CHECK(!out[0].beyond_border);
  CHECK(!out[1].beyond_border);
  CHECK(std::abs(out[1].overhang_mm - 0.4) < 1e-12);
  CHECK(out[2].beyond_border);
  CHECK(out[3].beyond_border);
  CHECK(out[3].place == FootPlace::corner);
  CHECK(std::abs(out[3].overhang_mm - 5) < 1e-12);
  CHECK(!out[4].beyond_border);
  for (int k = 0; k < 5; ++k)
    CHECK(std::abs(out[static_cast<std::size_t>(k)].mm -
                   std::array{1, 2, 3, 5, 6}[static_cast<std::size_t>(k)]) < 1e-12);
  std::vector<double> scratch(5);
  const DeviationSummary summary = summarize(out, scratch);
  CHECK(summary.count == 3);
  CHECK(summary.beyond_border == 2);
  CHECK(std::abs(summary.mean_mm - 3) < 1e-12);
}

TEST_CASE("points are carried by the pose before they are compared") {
  const BSplineSurface surface = yard_plate();
  const auto prepared = PreparedSurface::from(surface);
  const Known known = offset_points(surface, 10, 3);
  const RigidMotion design_from_plate = motion_about({30, 20, 10}, 50, {1, 3, -1}, {100, -40, 70});
  std::vector<Vector3d> carried;
  for (const Vector3d& p : known.points) carried.push_back(design_from_plate.inverse() * p);
  std::vector<Deviation> out(carried.size());
  REQUIRE(measure_deviations(*prepared, carried, {design_from_plate}, out));
  for (std::size_t i = 0; i < out.size(); ++i) CHECK(std::abs(out[i].mm - known.mm[i]) < 1e-11);
}

TEST_CASE("a point that is not a number is named, and no memory is taken on the way") {
  const BSplineSurface surface = yard_plate();
  const auto prepared = PreparedSurface::from(surface);
  Known known = offset_points(surface, 10, 3);
  std::vector<Deviation> out(known.points.size());
  std::vector<double> scratch(known.points.size());
  std::vector<DeviationCell> cells(16);
  const std::size_t before = allocations();
  REQUIRE(measure_deviations(*prepared, known.points, {}, out));
  const DeviationSummary summary = summarize(out, scratch);
  DeviationMap map(*prepared, cells, 4, 4);
  map.add(out);
  CHECK(allocations() == before);
  CHECK(summary.count == 100);
  known.points[37].y() = std::nan("");
  const auto failed = measure_deviations(*prepared, known.points, {}, out);
  REQUIRE(!failed);
  CHECK(failed.error().error == Error::not_finite);
  CHECK(failed.error().where == 37);
}

TEST_CASE("the summary is what sorting says") {
  std::mt19937 random(4);
  std::normal_distribution<double> number(0.3, 1);
  for (const std::size_t count : {std::size_t{1}, std::size_t{2}, std::size_t{99}, std::size_t{1000}}) {
    std::vector<Deviation> deviations(count);
    std::vector<double> sorted;
    double sum = 0, squares = 0;
    for (Deviation& d : deviations) {
      d.mm = number(random);
      sorted.push_back(d.mm);
      sum += d.mm, squares += d.mm * d.mm;
    }
    std::ranges::sort(sorted);
    std::vector<double> scratch(count);
    const DeviationSummary summary = summarize(deviations, scratch);
    CHECK(summary.count == count);
    CHECK(summary.least_mm == sorted.front());
    CHECK(summary.most_mm == sorted.back());
    CHECK(deviations[summary.least_point].mm == sorted.front());
    CHECK(deviations[summary.most_point].mm == sorted.back());
    const double n = static_cast<double>(count);
    CHECK(std::abs(summary.mean_mm - sum / n) < 1e-13);
    CHECK(std::abs(summary.rms_mm - std::sqrt(squares / n)) < 1e-13);
    for (std::size_t k = 0; k < summary.percentiles_mm.size(); ++k) {
      // Nearest rank: the least number that at least this share of all does not exceed.
      std::size_t rank = 0;
      while (static_cast<double>(rank + 1) < DeviationSummary::levels[k] * n) ++rank;
      CHECK(summary.percentiles_mm[k] == sorted[rank]);
    }
  }
  CHECK(summarize({}, {}).count == 0);
}

TEST_CASE("the map gathers what falls into each of its cells") {
  const auto flat = PreparedSurface::from(plate(4, 100, [](double, double) { return 0.0; }));
  std::vector<DeviationCell> cells(6);
  DeviationMap map(*flat, cells, 2, 3);
  const std::vector<Deviation> deviations{{1.0, 0.1, 0.1},
                                          {3.0, 0.4, 0.3},
                                          {-2.0, 0.6, 0.99},
                                          {5.0, 1.0, 1.0},
                                          {9.0, 0.2, 0.9, 2, FootPlace::side, true}};
  map.add(deviations);
  CHECK(map.cell(0, 0).count == 2);
  CHECK(map.cell(0, 0).mean_mm() == 2);
  CHECK(map.cell(0, 0).least_mm == 1);
  CHECK(map.cell(0, 0).most_mm == 3);
  CHECK(map.cell(1, 2).count == 2);
  CHECK(map.cell(1, 2).least_mm == -2);
  CHECK(map.cell(1, 2).most_mm == 5);
  CHECK(map.cell(0, 2).count == 0);
  CHECK(map.cell(0, 2).mean_mm() == 0);
}

TEST_CASE("a dent pressed into a plate is found where it is and as deep as it is, wherever the plate lies") {
  // The sequence of README.md: what the yard asks is where the plate differs from what it must become.
  const BSplineSurface design = yard_plate();
  const auto prepared = PreparedSurface::from(design);
  const auto dent = [](double u, double v) {
    const double r2 = (std::pow(u - 84.5 / 120, 2) + std::pow(v - 30.5 / 120, 2)) / (0.06 * 0.06);
    return r2 < 1 ? -1.5 * std::pow(1 - r2, 3) : 0.0;
  };
  const RigidMotion plate_from_design = motion_about({150, 150, 0}, 12, {1, -2, 0.7}, {40, -25, 90});
  std::vector<Vector3d> measured;
  for (int i = 0; i < 120; ++i) {
    for (int j = 0; j < 120; ++j) {
      const double u = (i + 0.5) / 120, v = (j + 0.5) / 120;
      const SurfacePoint r = design.at(u, v);
      measured.push_back(plate_from_design * (r.value + dent(u, v) * r.normal()));
    }
  }
  LocalizationSettings settings;
  settings.robust = true;  // the dent is not to tilt the plate
  const auto lies = localize(*prepared, measured, settings);
  REQUIRE(lies);
  std::vector<Deviation> deviations(measured.size());
  REQUIRE(measure_deviations(*prepared, measured, {lies->design_from_plate}, deviations));
  std::vector<double> scratch(deviations.size());
  const DeviationSummary summary = summarize(deviations, scratch);
  std::vector<DeviationCell> cells(400);
  DeviationMap map(*prepared, cells, 20, 20);
  map.add(deviations);
  // The biweight takes the dent for outliers but for its rim, and the rest of the plate is exact.
  CHECK(std::abs(summary.least_mm + 1.5) < 1e-3);
  CHECK(summary.least_point == 84 * 120 + 30);
  CHECK(std::abs(map.cell(3, 15).mean_mm()) < 1e-3);
  int deepest_row = 0, deepest_column = 0;
  for (int row = 0; row < 20; ++row) {
    for (int column = 0; column < 20; ++column) {
      if (map.cell(row, column).mean_mm() < map.cell(deepest_row, deepest_column).mean_mm())
        deepest_row = row, deepest_column = column;
    }
  }
  CHECK((deepest_row == 13 || deepest_row == 14));  // u = 0.704 is close to the line between the two
  CHECK((deepest_column == 4 || deepest_column == 5));
}
