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
        "the robot says it has arrived 5.01 mm and 0.00 degrees off its target ([robot] arrival_mm, "
        "arrival_deg: 5, 2): "
        "look where the arm stands");
  hal::Pose other = target;
  other.yaw = 325 * hal::degree, other.roll = 360 * hal::degree;  // straight down only yaw - roll counts
  CHECK(refused(other) == "");
  other.roll = 362.1 * hal::degree;
  CHECK(refused(other).find("0.00 mm and 2.10 degrees") != std::string::npos);
  other = target, other.pitch = 0;
  CHECK(refused(other).find("and 180.00 degrees") != std::string::npos);
  other = target, other.x_mm = 999'999.999;
  CHECK(refused(other).find("999600.00 mm and 0.00") != std::string::npos);
}

TEST_CASE("an arm that is found outside is believed as far as it may be parked there, and not beyond") {
  Workspace roomy = cell;
  roomy.parked_mm = 150;
  const auto refused = [&](double x, double y, double z) {
    const auto no = refuse_standing({.x_mm = x, .y_mm = y, .z_mm = z}, roomy);
    return no ? std::string{no->view()} : "";
  };
  CHECK(refused(500, 0, 300) == "");
  CHECK(refused(500, 0, 650) == "");  // 150 mm over the highest target
  CHECK(
      refused(500, 0, 651) ==
      "the robot says it stands at z 651.0 mm, [robot.workspace] ends at 500.0 mm: bring it nearer, correct "
      "its units, or raise [robot.workspace] parked_mm");
  CHECK(refused(100, 0, 300) == "");  // 150 mm inside the ring
  CHECK(refused(99, 0, 300).find("reach 99.0 mm, [robot.workspace] ends at 250.0 mm") != std::string::npos);
  CHECK(refused(0.5, 0.1, 0.3).find("reach 0.5") == std::string::npos);  // metres: z is named first
  CHECK(refused(0.5, 0.1, 0.3).find("z 0.3 mm, [robot.workspace] ends at 200.0") != std::string::npos);
  CHECK(refused(-951, 0, 300).find("x -951.0 mm") != std::string::npos);
  CHECK(refused(500, 951, 300).find("y 951.0 mm") != std::string::npos);
  CHECK(refused(940, 500, 300).find("reach 1064.7 mm") != std::string::npos);
}

TEST_CASE("a pose that is not a number is believed in no place") {
  const Arrival limits;
  for (const hal::Pose& pose : {hal::Pose{.x_mm = NAN}, hal::Pose{.x_mm = 500, .z_mm = INFINITY},
                                hal::Pose{.x_mm = 500, .z_mm = 300, .pitch = NAN}}) {
    for (const auto& no : {refuse_arrival(pose, pose, limits), refuse_standing(pose, cell),
                           refuse_drift(pose, pose, limits)}) {
      REQUIRE(no);
      CHECK(no->view() ==
            "the robot says it stands at no place at all (a pose that is not finite): correct its program");
    }
  }
}

TEST_CASE("an arm that stands may tremble within the limits of an arrival, not wander") {
  const Arrival limits{.distance_mm = 0.3, .turn_rad = 0.05 * hal::degree};
  const hal::Pose stood{.x_mm = 400, .y_mm = -80, .z_mm = 155, .pitch = 180 * hal::degree};
  hal::Pose is = stood;
  is.z_mm -= 0.29;
  CHECK_FALSE(refuse_drift(is, stood, limits));
  is.z_mm -= 0.02;
  REQUIRE(refuse_drift(is, stood, limits));
  CHECK(
      refuse_drift(is, stood, limits)->view() ==
      "the robot says it stands 0.31 mm and 0.00 degrees from where it said it stopped ([robot] arrival_mm, "
      "arrival_deg): look whether it moved, or who moves it");
  is = stood, is.roll = 0.06 * hal::degree;
  CHECK(refuse_drift(is, stood, limits)->view().find("0.00 mm and 0.06 degrees") != std::string_view::npos);
}
