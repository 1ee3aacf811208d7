#include "tasks/planning/tool_pose.hpp"

#include <doctest/doctest.h>

#include <numbers>

using namespace moldloft;
using namespace moldloft::tasks;

namespace {
geometry::RigidMotion mount(double tilt) {
  geometry::RigidMotion m = geometry::RigidMotion::Identity();
  m.linear() = geometry::rotation_from_zyz({0, std::numbers::pi, std::numbers::pi}) *
               Eigen::AngleAxisd(tilt, Eigen::Vector3d::UnitX()).toRotationMatrix();
  m.translation() << 3, 140, 300;
  return m;
}
}  // namespace

TEST_CASE("the tip pose brings the field's centre to its place, for every turn of the head") {
  for (double yaw = -3; yaw <= 3; yaw += 0.5) {
    const ShotPlace place{.centre = {480, -35, 12}, .head_yaw = yaw};
    const auto pose = tip_pose_for(place, mount(0.002));
    const auto world_from_scanner = motion_of(pose) * mount(0.002);
    CHECK((world_from_scanner.translation() - place.centre).norm() < 1e-9);
    const Eigen::Vector3d axis = world_from_scanner.linear().col(0);
    CHECK(std::abs(geometry::wrapped_angle(std::atan2(axis.y(), axis.x()) - yaw)) < 1e-9);
    CHECK(pose.pitch == doctest::Approx(std::numbers::pi));  // a SCARA's tool points down
  }
}

TEST_CASE("the scanner looks down on the plate with its z axis up") {
  const auto world_from_scanner =
      motion_of(tip_pose_for({.centre = {400, 0, 0}, .head_yaw = 0.3}, mount(0))) * mount(0);
  CHECK((world_from_scanner.linear().col(2) - Eigen::Vector3d::UnitZ()).norm() < 1e-9);
}

TEST_CASE("equation (5.1) of the thesis is the mount without tilt, 140 mm off along the tip's y") {
  // P' = R(a) P + T with R turning by -a about z and T = tip + (140 sin a, 140 cos a, 0).
  geometry::RigidMotion thesis_mount = geometry::RigidMotion::Identity();
  thesis_mount.translation() << 0, 140, 0;
  const double a = 0.6;
  const Eigen::Vector3d tip{500, 20, 100}, p{10, -7, 3};
  geometry::RigidMotion world_from_tip = geometry::turned_about_z(-a, tip);
  const Eigen::Vector3d ours = world_from_tip * thesis_mount * p;
  Eigen::Matrix3d r;
  r << std::cos(a), std::sin(a), 0, -std::sin(a), std::cos(a), 0, 0, 0, 1;
  const Eigen::Vector3d theirs = r * p + tip + Eigen::Vector3d{140 * std::sin(a), 140 * std::cos(a), 0};
  CHECK((ours - theirs).norm() < 1e-12);
}

TEST_CASE("pose and motion are each other's inverse") {
  const hal::Pose pose{.x_mm = 1, .y_mm = 2, .z_mm = 3, .yaw = 0.4, .pitch = 1.1, .roll = -2};
  const auto back = pose_of(motion_of(pose));
  CHECK(back.yaw == doctest::Approx(pose.yaw));
  CHECK(back.pitch == doctest::Approx(pose.pitch));
  CHECK(back.roll == doctest::Approx(pose.roll));
  CHECK(back.x_mm == 1);
}
