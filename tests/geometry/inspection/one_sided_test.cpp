// One-sided localization: no point through the surface, and nothing closer is possible.
#include "geometry/inspection/known_surfaces.hpp"
#include "geometry/inspection/localization.hpp"

#include <Eigen/QR>
#include <doctest/doctest.h>

#include <algorithm>

using namespace moldloft::geometry;
using namespace moldloft::test;

namespace {

struct Seen {
  double least = 1e300, most = -1e300;  // signed distances
  std::vector<double> mm;
  std::vector<Eigen::Matrix<double, 6, 1>> rows;  // their derivatives by the small motion about the centroid
};

Seen seen_at(const PreparedSurface& design, const std::vector<Vector3d>& points, const Localization& found) {
  Seen seen;
  for (const Vector3d& p : points) {
    const Vector3d q = found.design_from_plate * p;
    const FootPoint foot = nearest_foot(design, q).foot;
    Eigen::Matrix<double, 6, 1> row;
    row << foot.normal, (q - found.centroid).cross(foot.normal) / 120;  // turns in mm at 120 mm
    seen.rows.push_back(row);
    seen.mm.push_back(foot.signed_mm);
    seen.least = std::min(seen.least, foot.signed_mm), seen.most = std::max(seen.most, foot.signed_mm);
  }
  return seen;
}

// A plate that differs from its design by up to about half a millimetre, smoothly, with measuring
// noise on top.
std::vector<Vector3d> formed_plate(const BSplineSurface& design, int count) {
  std::mt19937 random(21);
  std::uniform_real_distribution<double> inside(0.03, 0.97);
  std::normal_distribution<double> noise(0, 0.02);
  std::vector<Vector3d> points;
  for (int i = 0; i < count; ++i) {
    const double u = inside(random), v = inside(random);
    const SurfacePoint r = design.at(u, v);
    points.push_back(r.value + (0.4 * std::sin(5 * u) * std::cos(4 * v) + noise(random)) * r.normal());
  }
  return points;
}

// Karush, Kuhn and Tucker: the slope of the sum of squares is carried by pushing contacts alone. What is left
// of it, per point and in mm, is how far a step that settles (1e-6 mm) may be off.
void check_optimal(const Seen& seen, const Localization& found, double sign, double tolerance_mm) {
  Eigen::Matrix<double, 6, 1> slope = Eigen::Matrix<double, 6, 1>::Zero();
  for (std::size_t i = 0; i < seen.mm.size(); ++i) slope += seen.mm[i] * seen.rows[i];
  slope /= static_cast<double>(seen.mm.size());
  REQUIRE(found.contact_count >= 1);
  Eigen::MatrixXd pushes(6, found.contact_count);
  double shares = 0;
  for (int k = 0; k < found.contact_count; ++k) {
    const Contact& contact = found.contacts[static_cast<std::size_t>(k)];
    pushes.col(k) = sign * seen.rows[contact.point];
    CHECK(std::abs(sign * seen.mm[contact.point] + tolerance_mm) < 2e-6);
    CHECK(contact.share > 0);
    shares += contact.share;
  }
  CHECK(std::abs(shares - 1) < 1e-12);
  const Eigen::VectorXd force = pushes.colPivHouseholderQr().solve(slope);
  CHECK(force.minCoeff() >= 0);
  CHECK((pushes * force - slope).norm() < 5e-6);
  for (int k = 0; k < found.contact_count; ++k)
    CHECK(std::abs(force[k] / force.sum() - found.contacts[static_cast<std::size_t>(k)].share) < 1e-4);
}

}  // namespace

TEST_CASE("a one-sided pose keeps all of the plate on its side, and no pose is closer") {
  const BSplineSurface design = yard_plate();
  const auto prepared = PreparedSurface::from(design);
  const std::vector<Vector3d> points = formed_plate(design, 600);
  const auto free = localize(*prepared, points);
  REQUIRE(free);
  for (const AllowedSide side : {AllowedSide::above, AllowedSide::below}) {
    for (const double tolerance : {0.0, 0.1}) {
      LocalizationSettings settings;
      settings.side = side;
      settings.tolerance_mm = tolerance;
      settings.start = motion_about({150, 150, 0}, 20, {1, 2, 0.4}, {5, -15, 20});
      const auto found = localize(*prepared, points, settings);
      REQUIRE(found);
      const Seen seen = seen_at(*prepared, points, *found);
      const double sign = side == AllowedSide::above ? 1 : -1;
      CHECK((sign > 0 ? seen.least : -seen.most) >= -tolerance - 1e-9);
      CHECK(found->rms_mm > free->rms_mm);
      check_optimal(seen, *found, sign, tolerance);
    }
  }
}

TEST_CASE("a bound that the free pose keeps changes nothing") {
  const BSplineSurface design = yard_plate();
  const auto prepared = PreparedSurface::from(design);
  const std::vector<Vector3d> points = formed_plate(design, 300);
  const auto free = localize(*prepared, points);
  LocalizationSettings settings;
  settings.side = AllowedSide::above;
  settings.tolerance_mm = 5;
  const auto found = localize(*prepared, points, settings);
  REQUIRE((free && found));
  CHECK(found->contact_count == 0);
  CHECK(std::abs(found->rms_mm - free->rms_mm) < 1e-9);
}

TEST_CASE("a plate on three feet stands on them") {
  // A flat design, a flat plate, and three bumps below it: with the slides fixed the plane through their tips
  // is the answer, for any tilt about two of them brings the far side up.
  const auto flat = PreparedSurface::from(plate(4, 300, [](double, double) { return 0.0; }));
  std::vector<Vector3d> points;
  for (int i = 0; i < 20; ++i) {
    for (int j = 0; j < 20; ++j) points.push_back({5.0 + 15 * i, 5.0 + 15 * j, 0});
  }
  const std::vector<Vector3d> feet{{30, 40, -1}, {270, 60, -2}, {140, 265, -1.5}};
  points.insert(points.end(), feet.begin(), feet.end());
  LocalizationSettings settings;
  settings.side = AllowedSide::above;
  settings.fixed = {true, true, false, false, false, true};
  const auto found = localize(*flat, points, settings);
  REQUIRE(found);
  CHECK(found->contact_count == 3);
  for (const Vector3d& foot : feet) CHECK(std::abs((found->design_from_plate * foot).z()) < 1e-9);
}

TEST_CASE("where every direction is fixed a plate through the surface has no pose") {
  const auto flat = PreparedSurface::from(plate(4, 300, [](double, double) { return 0.0; }));
  const std::vector<Vector3d> points{{10, 10, 1}, {200, 10, -1}, {100, 200, 1}};
  LocalizationSettings settings;
  settings.side = AllowedSide::above;
  settings.fixed = {true, true, true, true, true, true};
  CHECK(localize(*flat, points, settings).error().error == Error::no_feasible_pose);
  settings.fixed = {true, true, true, false, true, true};
  CHECK(localize(*flat, points, settings).error().error == Error::no_feasible_pose);
  settings.tolerance_mm = 1.5;
  settings.fixed[3] = true;
  CHECK(localize(*flat, points, settings));
}

TEST_CASE("outliers that were told apart do not hold the plate off") {
  const BSplineSurface design = yard_plate();
  const auto prepared = PreparedSurface::from(design);
  std::vector<Vector3d> points = formed_plate(design, 400);
  points[17] -= Vector3d(0, 0, 30);
  LocalizationSettings settings;
  settings.side = AllowedSide::above;
  settings.robust = true;
  const auto found = localize(*prepared, points, settings);
  REQUIRE(found);
  CHECK(found->outliers == 1);
  CHECK(found->rms_mm < 2);
  for (int k = 0; k < found->contact_count; ++k)
    CHECK(found->contacts[static_cast<std::size_t>(k)].point != 17);
}
