#include "tasks/cell/motion_guard.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <string>

using namespace moldloft;
using namespace moldloft::tasks;

namespace {
const Workspace cell{.x_mm = {-800, 800},
                     .y_mm = {-800, 800},
                     .z_mm = {200, 500},
                     .reach_mm = {250, 800},
                     .max_step_mm = 600,
                     .max_speed_percent = 80};
const hal::Pose standing{.x_mm = 500, .z_mm = 300};

std::string refusal(const hal::Pose& target, int speed = 50) {
  const auto no = refuse_target(target, standing, speed, cell);
  return no ? std::string{no->view()} : "";
}
}  // namespace

TEST_CASE("a target within every limit may be sent") {
  CHECK(refusal({.x_mm = 600, .y_mm = 100, .z_mm = 300}) == "");
  CHECK(refusal({.x_mm = 800, .z_mm = 500}) == "");  // limits belong to the workspace
}

TEST_CASE("each limit refuses by its name and value") {
  CHECK(refusal({.x_mm = 801, .z_mm = 300}) ==
        "target outside the workspace: x 801.0 mm, limit -800.0 to 800.0 mm: move the plate, or widen "
        "[robot.workspace] if the arm may go there");
  CHECK(refusal({.x_mm = 500, .z_mm = 199}) ==
        "target outside the workspace: z 199.0 mm, limit 200.0 to 500.0 mm: move the plate, or widen "
        "[robot.workspace] if the arm may go there");
  CHECK(refusal({.x_mm = 100, .y_mm = 100, .z_mm = 300}).find("reach 141.4") != std::string::npos);
  CHECK(refusal({.x_mm = -500, .z_mm = 300}).find("step 1000.0") != std::string::npos);
  CHECK(refusal({.x_mm = 500, .z_mm = 300}, 81).find("speed 81 %") != std::string::npos);
  CHECK(refusal({.x_mm = 500, .z_mm = 300}, 0).find("speed 0 %") != std::string::npos);
}

TEST_CASE("a target that is not a number is refused before any comparison with it") {
  CHECK(refusal({.x_mm = NAN, .z_mm = 300}).find("not finite") != std::string::npos);
  CHECK(refusal({.x_mm = 500, .z_mm = 300, .roll = INFINITY}).find("not finite") != std::string::npos);
}

TEST_CASE(
    "an arrival is believed within the limits, in whatever angles it is said, and named when it is not") {
  const Arrival limits{.distance_mm = 5, .turn_rad = 2 * hal::degree};
  const hal::Pose target{
      .x_mm = 400, .y_mm = -80, .z_mm = 155, .pitch = 180 * hal::degree, .roll = 35 * hal::degree};
  const auto refused = [&](const hal::Pose& reported) {
    const auto no = refuse_arrival(reported, target, limits);
    return no ? std::string{no->view()} : "";
  };
  CHECK(refused(target) == "");
  CHECK(refused({.x_mm = 403, .y_mm = -76, .z_mm = 155, .pitch = target.pitch, .roll = target.roll}) ==
        "");  // 5 mm
  CHECK(refused({.x_mm = 403.01, .y_mm = -76, .z_mm = 155, .pitch = target.pitch, .roll = target.roll}) ==
        "the robot says it has arrived 5.0 mm and 0.0 degrees off its target ([robot] arrival_mm, "
        "arrival_deg: 5, 2): "
        "look where the arm stands");
  hal::Pose other = target;
  other.yaw = 325 * hal::degree, other.roll = 360 * hal::degree;  // straight down only yaw - roll counts
  CHECK(refused(other) == "");
  other.roll = 362.1 * hal::degree;
  CHECK(refused(other).find("0.0 mm and 2.1 degrees") != std::string::npos);
  other = target, other.pitch = 0;
  CHECK(refused(other).find("and 180.0 degrees") != std::string::npos);
  other = target, other.x_mm = 999'999.999;
  CHECK(refused(other).find("999600.0 mm and 0.0") != std::string::npos);
}
