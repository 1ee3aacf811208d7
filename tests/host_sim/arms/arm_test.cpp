#include "host_sim/arms/arm_drive.hpp"
#include "host_sim/arms/gantry_arm.hpp"
#include "host_sim/arms/scara_arm.hpp"
#include "tasks/planning/tool_pose.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <numbers>

using namespace moldloft;
using namespace moldloft::host_sim;
using namespace std::chrono_literals;

namespace {

hal::Pose down_at(double x, double y, double z, double roll_degrees) {
  return {x, y, z, 0, std::numbers::pi, roll_degrees * hal::degree};
}

double distance(const hal::Pose& a, const hal::Pose& b) {
  return (tasks::motion_of(a).matrix() - tasks::motion_of(b).matrix()).cwiseAbs().maxCoeff();
}

constexpr ArmErrors no_errors{0, 0, 0, 0};

}  // namespace

TEST_CASE("SCARA joints and poses go round trip over the whole workspace") {
  const auto arm = make_scara({});
  int reached = 0;
  for (double x = -750; x <= 750; x += 125) {
    for (double y = -750; y <= 750; y += 125) {
      for (double roll = -180; roll < 180; roll += 45) {
        const auto pose = down_at(x, y, 350, roll);
        const auto joints = arm->joints_for(pose, arm->home());
        if (!joints) continue;
        ++reached;
        CHECK(
            (arm->world_from_tip(*joints).matrix() - tasks::motion_of(pose).matrix()).cwiseAbs().maxCoeff() <
            1e-9);
        CHECK((*joints)[1] > 0);  // it never changes the side of its elbow
      }
    }
  }
  CHECK(reached > 500);
}

TEST_CASE("the SCARA refuses what it cannot reach and names the limit") {
  const auto arm = make_scara({});
  const auto why = [&](const hal::Pose& p) { return arm->joints_for(p, arm->home()).error().text; };
  CHECK(why(down_at(801, 0, 350, 0)).view() ==
        "the tip would be 801.0 mm from the base, the arm reaches 800.0");
  CHECK(arm->joints_for(down_at(799, 0, 350, 0), arm->home()).has_value());
  // sqrt(425^2 + 375^2 - 2 425 375 cos 33) = 232.2
  CHECK(why(down_at(231, 0, 350, 0)).view() ==
        "the tip would be 231.0 mm from the base, joint 2 folds no further than 232.2");
  CHECK(arm->joints_for(down_at(233, 0, 350, 0), arm->home()).has_value());
  const auto low = arm->joints_for(down_at(500, 0, 294, 0), arm->home());
  CHECK(low.error().text.view() == "z (joint 3) would stand at 294.0 mm, its limits are 295.0 and 490.0");
  CHECK(arm->joints_for(down_at(-600, -100, 350, 0), arm->home()).error().text.view().starts_with("joint 1"));
  hal::Pose tilted = down_at(500, 0, 350, 0);
  tilted.pitch = 170 * hal::degree;
  CHECK_FALSE(arm->joints_for(tilted, arm->home()).has_value());
  const auto broken = plan_motion(*arm, arm->home(), down_at(std::nan(""), 0, 350, 0), 50);
  CHECK_FALSE(broken.has_value());
}

TEST_CASE("joint 4 takes the shortest way round and unwinds at its limit") {
  const auto arm = make_scara({});
  auto joints = *arm->joints_for(down_at(500, 0, 350, 0), arm->home());
  double before = joints[3];
  int unwound = 0;
  for (double roll = 20; roll <= 720; roll += 20) {
    const auto turned = arm->joints_for(down_at(500, 0, 350, roll), joints);
    REQUIRE(turned.has_value());
    joints = *turned;
    const double moved = std::abs(joints[3] - before);
    CHECK((moved == doctest::Approx(20 * hal::degree) || moved == doctest::Approx(340 * hal::degree)));
    CHECK(std::abs(joints[3]) <= 277 * hal::degree);
    unwound += moved > 5;
    before = joints[3];
  }
  CHECK(unwound >= 1);
}

TEST_CASE("one joint alone moves as the closed form of a trapezoid says") {
  const JointLimits limits = {
      {{"x", -1e3, 1e3, 100, 400}, {"y", -1e3, 1e3, 50, 400}, {"z", 0, 0, 1, 1}, {"r", 0, 0, 1, 1}}};
  const JointMotion fast({0, 0, 0, 0}, {100, 0, 0, 0}, limits, 1.0);
  CHECK(fast.duration_s() == doctest::Approx(100.0 / 100 + 100.0 / 400));
  CHECK(fast.at(0.25)[0] == doctest::Approx(0.5 * 400 * 0.0625));
  const JointMotion triangle({0, 0, 0, 0}, {16, 0, 0, 0}, limits, 1.0);
  CHECK(triangle.duration_s() == doctest::Approx(2 * std::sqrt(16.0 / 400)));
  const JointMotion half({0, 0, 0, 0}, {100, 0, 0, 0}, limits, 0.5);
  CHECK(half.duration_s() == doctest::Approx(100.0 / 50 + 50.0 / 200));
  const JointMotion both({0, 0, 0, 0}, {100, 100, 0, 0}, limits, 1.0);  // y is the slower one, x goes along
  CHECK(both.duration_s() == doctest::Approx(100.0 / 50 + 50.0 / 400));
  CHECK(both.at(1.0)[0] == doctest::Approx(both.at(1.0)[1]));
  CHECK(both.at(9.0) == Joints{100, 100, 0, 0});
}

TEST_CASE("braking ends a motion after v / a, v^2 / 2a farther on") {
  const JointLimits limits = {
      {{"x", -1e3, 1e3, 100, 400}, {"y", 0, 0, 1, 1}, {"z", 0, 0, 1, 1}, {"r", 0, 0, 1, 1}}};
  JointMotion motion({0, 0, 0, 0}, {100, 0, 0, 0}, limits, 1.0);
  motion.brake_at(0.5);
  CHECK(motion.duration_s() == doctest::Approx(0.5 + 100.0 / 400));
  CHECK(motion.at(10)[0] == doctest::Approx((0.5 - 0.125) * 100 + 100.0 * 100 / 800));
}

TEST_CASE("errors are drawn at each stop with their sigma, and the encoders do not show them") {
  ArmDrive drive(make_scara({}), {}, 3);
  hal::Instant now{0};
  double squares = 0, sum = 0;
  constexpr int stops = 400;
  for (int k = 0; k < stops; ++k) {
    const auto target = down_at(500 + k % 7, 30 - k % 5, 330, 180);
    REQUIRE(drive.start(target, 100, now).has_value());
    now = drive.settled_at();
    CHECK(distance(drive.reported_pose(now), target) < 1e-3);
    const double x_error = drive.true_world_from_tip(now).translation().x() - target.x_mm;
    squares += x_error * x_error;
    sum += x_error;
  }
  CHECK(std::sqrt(squares / stops) == doctest::Approx(0.038).epsilon(0.12).scale(0));
  CHECK(std::abs(sum / stops) < 4 * 0.038 / std::sqrt(stops));
}

TEST_CASE("between stops the true pose never jumps") {
  ArmDrive drive(make_scara({}), {}, 3);
  REQUIRE(drive.start(down_at(500, 0, 330, 180), 100, 0ns).has_value());
  const hal::Instant second = drive.settled_at();
  double worst = 0;
  Eigen::Vector3d before = drive.true_world_from_tip(0ns).translation();
  for (hal::Instant t{0}; t < second + 1s; t += 1ms) {
    if (t >= second && t < second + 1ms) REQUIRE(drive.start(down_at(400, 100, 330, 90), 100, t).has_value());
    const Eigen::Vector3d at = drive.true_world_from_tip(t).translation();
    worst = std::max(worst, (at - before).norm());
    before = at;
  }
  CHECK(worst < 3.0);  // mm in 1 ms: 3 m/s, the fastest that two joints can bring
  CHECK(worst > 0.1);
}

TEST_CASE("a link that is longer than believed shows in the true pose only") {
  ScaraSettings longer;
  longer.link_2_error_mm = 0.5;
  ArmDrive drive(make_scara(longer), {no_errors, 80ms}, 1);
  const auto target = down_at(600, 0, 330, 180);
  REQUIRE(drive.start(target, 100, 0ns).has_value());
  const auto now = drive.settled_at();
  CHECK(distance(drive.reported_pose(now), target) < 1e-3);
  CHECK((drive.true_world_from_tip(now).translation() - tasks::motion_of(target).translation()).norm() ==
        doctest::Approx(0.5));
}

TEST_CASE("the gantry reaches its volume and no more") {
  const auto arm = make_gantry({});
  const auto pose = down_at(2900, 100, 350, 45);
  const auto joints = arm->joints_for(pose, arm->home());
  REQUIRE(joints.has_value());
  CHECK((arm->world_from_tip(*joints).matrix() - tasks::motion_of(pose).matrix()).cwiseAbs().maxCoeff() <
        1e-9);
  CHECK(arm->joints_for(down_at(3001, 100, 350, 45), arm->home()).error().text.view() ==
        "x axis would stand at 3001.0 mm, its limits are 0.0 and 3000.0");
}
