#include "firmware_like/report/result_table.hpp"

#include <doctest/doctest.h>

using namespace moldloft;
using namespace moldloft::firmware_like;

TEST_CASE("the result table shows what the result holds, and leaves out what it does not") {
  RunResult r;
  r.outcome = Outcome::complete;
  r.shots = {.seek = 2, .boundary = 14, .surface = 16, .retaken = 1};
  r.points_seen = 1600000;
  r.cycle = {.seconds = 17.71, .idle_fraction = 0.044, .standing_fraction = 0.18};
  auto& plate = r.measured.emplace();
  plate.outline.corners = {
      Eigen::Vector2d{692.931, 115.07}, {415.38, 241.23}, {289.12, -36.51}, {566.86, -162.65}};
  for (auto* net : {&plate.surface.x, &plate.surface.y, &plate.surface.z}) net->setZero(7, 7);
  plate.fit.points_used = 794087;
  plate.fit.sigma_mm = 0.0509;
  plate.fit.shot_offset_rms_mm = 0.0147;
  const std::string table = result_table(r, "out/run-1");
  CHECK(table.find("shots                       2 seeking, 14 boundary, 16 surface, 1 retaken\n") !=
        std::string::npos);
  CHECK(table.find("points used                 794087 of 1600000\n") != std::string::npos);
  CHECK(table.find("(692.93, 115.07) (415.38, 241.23)") != std::string::npos);
  CHECK(table.find("7 x 7 control points\n") != std::string::npos);
  CHECK(table.find("cell time, s                17.7 (arm standing 18 %, idle 4.4 %)\n") !=
        std::string::npos);
  CHECK(table.find("run folder                  out/run-1\n") != std::string::npos);
  CHECK(table.find("truth") == std::string::npos);
  r.truth = {{"normal_rms_mm", 0.0015},
             {"normal_max_mm", 0.0075},
             {"outline_max_mm", 0.083},
             {"corner_max_mm", 0.073}};
  CHECK(result_table(r, "").find("normal rms 0.0015, max 0.0075; outline max 0.083; corner max 0.073\n") !=
        std::string::npos);
}
