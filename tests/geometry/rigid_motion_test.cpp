#include "geometry/rigid_motion.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <numbers>
#include <random>

using namespace moldloft::geometry;
constexpr double pi = std::numbers::pi;

TEST_CASE("ZYZ' angles turn the axes as the V+ manual says") {
  // Yaw 90, pitch 90: the tool axis first tips towards +x, then turns to +y.
  const Eigen::Matrix3d r = rotation_from_zyz({pi / 2, pi / 2, 0});
  CHECK((r.col(2) - Eigen::Vector3d::UnitY()).norm() < 1e-15);
  // A tool that points straight down: pitch 180, and a roll turns it clockwise seen from above.
  const Eigen::Matrix3d down = rotation_from_zyz({0, pi, pi / 6});
  CHECK((down.col(2) + Eigen::Vector3d::UnitZ()).norm() < 1e-15);
  CHECK((down * Eigen::Vector3d::UnitX() - Eigen::Vector3d(-std::cos(pi / 6), 0.5, 0)).norm() < 1e-15);
}

TEST_CASE("angles and rotations are each other's inverse, also beside and at the gimbal") {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> turn(-pi, pi), tip(0, pi);
  double worst = 0;
  for (int i = 0; i < 20'000; ++i) {
    ZyzAngles angles{turn(random), tip(random), turn(random)};
    if (i % 10 == 1) angles.pitch = 0;
    if (i % 10 == 2) angles.pitch = pi;
    if (i % 10 == 3) angles.pitch = 1e-7;
    if (i % 10 == 4) angles.pitch = 1e-12;
    if (i % 10 == 5) angles.pitch = pi - 1e-12;
    const Eigen::Matrix3d r = rotation_from_zyz(angles);
    const ZyzAngles back = zyz_from_rotation(r);
    CHECK_MESSAGE((back.pitch >= 0 && back.pitch <= pi), back.pitch);
    CHECK_MESSAGE((back.yaw > -pi && back.yaw <= pi && back.roll > -pi && back.roll <= pi), back.yaw);
    worst = std::max(worst, (rotation_from_zyz(back) - r).cwiseAbs().maxCoeff());
  }
  CHECK(worst < 2e-9);  // half the gimbal's width where yaw and roll were merged, rounding elsewhere
}

TEST_CASE("at the gimbal yaw is zero and roll carries the turn") {
  const ZyzAngles down = zyz_from_rotation(rotation_from_zyz({0.3, pi, 1.0}));
  CHECK(down.yaw == 0);
  CHECK(down.roll == doctest::Approx(0.7).epsilon(1e-12));
  const ZyzAngles up = zyz_from_rotation(rotation_from_zyz({0.3, 0, 1.0}));
  CHECK(up.yaw == 0);
  CHECK(up.roll == doctest::Approx(1.3).epsilon(1e-12));
}

TEST_CASE("equation (5.1) of the thesis is a turn about joint 4 of a scanner held 140 mm out") {
  // P' = R P + T with R = [[cos a, sin a, 0], [-sin a, cos a, 0], [0, 0, 1]], T = tip + (140 sin a, 140
  // cos a, 0).
  const double a = 0.4;
  const Eigen::Vector3d tip(300, 200, 100), p(12, -7, 3);
  const Eigen::Vector3d thesis = Eigen::Vector3d(std::cos(a) * p.x() + std::sin(a) * p.y(),
                                                 -std::sin(a) * p.x() + std::cos(a) * p.y(), p.z()) +
                                 tip + Eigen::Vector3d(140 * std::sin(a), 140 * std::cos(a), 0);
  const RigidMotion world_from_tip = turned_about_z(-a, tip);
  const RigidMotion tip_from_scanner = turned_about_z(0, {0, 140, 0});
  CHECK((world_from_tip * tip_from_scanner * p - thesis).norm() < 1e-12);
}

TEST_CASE("wrapped angles lie above -pi and up to pi") {
  CHECK(wrapped_angle(pi) == pi);
  CHECK(wrapped_angle(-pi) == pi);
  CHECK(wrapped_angle(3 * pi) == doctest::Approx(pi));
  CHECK(wrapped_angle(2 * pi + 0.25) == doctest::Approx(0.25));
  CHECK(wrapped_angle(-0.25) == -0.25);
}
