#include "host_sim/runs/judge.hpp"

#include "hal/temporary_folder.hpp"

#include <doctest/doctest.h>
#include <nlohmann/json.hpp>

#include <cmath>
#include <filesystem>
#include <fstream>

using namespace moldloft;
using namespace moldloft::host_sim;

namespace {

// The plate's own saddle as a B-spline: z is quadratic, x and y linear, so a bicubic net holds it
// exactly. Blossoms: linear functions have Greville abscissae as coefficients, x^2 has the mean of
// pairwise knot products.
geometry::BSplineSurface saddle_surface(const PlateInstance& plate, double lift_mm, double stretch_mm,
                                        double amplitude_mm = 10) {
  geometry::BSplineSurface s;
  s.knots_u = s.knots_v = geometry::uniform_clamped_knots(3);
  constexpr int n = 6;
  const double half = 152.5 + stretch_mm;
  const auto coordinate = [half](double t) { return half * (2 * t - 1); };
  const auto linear = [&](int i) {
    const auto k = static_cast<std::size_t>(i);
    return (coordinate(s.knots_u[k + 1]) + coordinate(s.knots_u[k + 2]) + coordinate(s.knots_u[k + 3])) / 3;
  };
  const auto square = [&](int i) {
    const auto k = static_cast<std::size_t>(i);
    const double a = coordinate(s.knots_u[k + 1]), b = coordinate(s.knots_u[k + 2]),
                 c = coordinate(s.knots_u[k + 3]);
    return (a * b + b * c + c * a) / 3;
  };
  for (auto* net : {&s.x, &s.y, &s.z}) net->resize(n, n);
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < n; ++j) {
      const double z = amplitude_mm * (square(i) - square(j)) / (152.5 * 152.5) + lift_mm;
      const Eigen::Vector3d p = plate.world_from_plate() * Eigen::Vector3d{linear(i), linear(j), z};
      s.x(i, j) = p.x();
      s.y(i, j) = p.y();
      s.z(i, j) = p.z();
    }
  }
  return s;
}

PlateInstance saddle() { return resting_on_table(*make_plate({}), 500, 10, 0.6); }

}  // namespace

TEST_CASE("the true surface is judged faultless") {
  const auto plate = saddle();
  const auto verdict = judge(plate, saddle_surface(plate, 0, 0), plate.corners_in_world());
  REQUIRE(verdict.has_value());
  CHECK(verdict->normal_max_mm < 1e-9);
  CHECK(verdict->outline_max_mm < 1e-9);
  CHECK(verdict->corner_max_mm < 1e-9);
  CHECK(verdict->points > 9900);
}

TEST_CASE("a surface lifted by 0.1 mm lies 0.1 cos(slope) off along the normal") {
  const auto plate = saddle();
  const auto verdict = judge(plate, saddle_surface(plate, 0.1, 0), plate.corners_in_world());
  REQUIRE(verdict.has_value());
  CHECK(verdict->normal_max_mm == doctest::Approx(0.1).epsilon(1e-4));  // where the saddle is level
  double squares = 0;
  int count = 0;
  for (const auto& d : verdict->grid) {
    if (std::isnan(d.normal_mm)) continue;
    const Eigen::Vector3d p =
        plate.world_from_plate().inverse() * Eigen::Vector3d{d.world.x(), d.world.y(), 0};
    const double cosine = plate.plate->normal(p.x(), p.y()).z();
    CHECK(d.normal_mm == doctest::Approx(0.1 * cosine).epsilon(1e-3));
    squares += d.normal_mm * d.normal_mm;
    ++count;
  }
  CHECK(verdict->normal_rms_mm == doctest::Approx(std::sqrt(squares / count)));
}

TEST_CASE(
    "deviations run along the true normal: a flat surface over the saddle is met at height / cos(slope)") {
  const auto plate = saddle();
  const auto verdict = judge(plate, saddle_surface(plate, 0, 0, 0), plate.corners_in_world());
  REQUIRE(verdict.has_value());
  for (const auto& d : verdict->grid) {
    if (std::isnan(d.normal_mm)) continue;
    const Eigen::Vector3d p =
        plate.world_from_plate().inverse() * Eigen::Vector3d{d.world.x(), d.world.y(), 0};
    if (p.head<2>().cwiseAbs().maxCoeff() > 145)
      continue;  // at the border the normal may pass the surface by
    const double height = plate.plate->height(p.x(), p.y()), cosine = plate.plate->normal(p.x(), p.y()).z();
    CHECK(d.normal_mm == doctest::Approx(-height / cosine).epsilon(1e-7));
  }
}

TEST_CASE("an outline 0.25 mm too large is 0.25 sqrt 2 off at its corners") {
  const auto plate = saddle();
  auto corners = plate.corners_in_world();
  std::rotate(corners.begin(), corners.begin() + 2, corners.end());  // which comes first does not matter
  corners[1] += Eigen::Vector2d{0.0, 0.2};
  const auto verdict = judge(plate, saddle_surface(plate, 0, 0.25), corners);
  REQUIRE(verdict.has_value());
  CHECK(verdict->outline_max_mm == doctest::Approx(0.25 * std::sqrt(2.0)).epsilon(1e-6));
  CHECK(verdict->corner_max_mm == doctest::Approx(0.2).epsilon(1e-6));
  CHECK(verdict->normal_max_mm < 1e-9);
}

TEST_CASE("a run folder is judged and its summary gets the truth") {
  namespace fs = std::filesystem;
  const moldloft::hal::TemporaryFolder own;
  const fs::path folder = own.path();
  const auto plate = saddle();
  const auto surface = saddle_surface(plate, 0.1, 0);
  nlohmann::json control = nlohmann::json::array(), corners = nlohmann::json::array();
  for (int i = 0; i < 6; ++i) {
    nlohmann::json row = nlohmann::json::array();
    for (int j = 0; j < 6; ++j) row.push_back({surface.x(i, j), surface.y(i, j), surface.z(i, j)});
    control.push_back(row);
  }
  for (const auto& c : plate.corners_in_world()) corners.push_back({c.x(), c.y()});
  std::ofstream(folder / "surface.json") << nlohmann::json{{"schema", 1},
                                                           {"unit", "mm"},
                                                           {"degree", {3, 3}},
                                                           {"knots_u", surface.knots_u},
                                                           {"knots_v", surface.knots_v},
                                                           {"control", control}};
  std::ofstream(folder / "summary.json")
      << nlohmann::json{{"schema", 1}, {"boundary", {{"corners_mm", corners}}}};
  const auto verdict = judge_run(folder.string(), plate);
  REQUIRE_MESSAGE(verdict.has_value(), verdict.error().what);
  const auto summary = nlohmann::json::parse(std::ifstream(folder / "summary.json"));
  CHECK(summary["schema"] == 1);
  CHECK(summary["truth"]["normal_max_mm"].get<double>() == doctest::Approx(0.1).epsilon(1e-4));
  fs::remove(folder / "surface.json");
  CHECK(judge_run(folder.string(), plate).error().what ==
        (folder / "surface.json").string() + ": cannot be opened");
}
