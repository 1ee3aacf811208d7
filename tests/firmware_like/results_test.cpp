#include "firmware_like/results.hpp"

#include "firmware_like/run_command.hpp"
#include "hal/temporary_folder.hpp"

#include <doctest/doctest.h>

#include <csignal>
#include <fstream>
#include <sstream>
#include <sys/resource.h>

using namespace moldloft;
using namespace moldloft::firmware_like;
namespace fs = std::filesystem;

namespace {

std::string text_of(const fs::path& path) {
  std::ostringstream text;
  text << std::ifstream{path, std::ios::binary}.rdbuf();
  return text.str();
}

std::size_t files_in(const fs::path& folder) {
  return static_cast<std::size_t>(std::distance(fs::directory_iterator{folder}, fs::directory_iterator{}));
}

}  // namespace

TEST_CASE("a file is written whole, byte for byte, and replaces the one before") {
  const hal::TemporaryFolder folder;
  const fs::path path = folder.file("summary.json");
  const std::string bytes{"a\0b\r\n\xff", 6};
  REQUIRE(write_file(path, "first, and longer than what follows").has_value());
  REQUIRE(write_file(path, bytes).has_value());
  CHECK(text_of(path) == bytes);
  CHECK(files_in(folder.path()) == 1);  // nothing is left beside it
}

TEST_CASE("a disk that is full leaves the file of before as it was") {
  const hal::TemporaryFolder folder;
  const fs::path path = folder.file("summary.json");
  REQUIRE(write_file(path, "before").has_value());
  std::signal(SIGXFSZ, SIG_IGN);
  rlimit limit{};
  ::getrlimit(RLIMIT_FSIZE, &limit);
  const rlimit full{1000, limit.rlim_max};
  ::setrlimit(RLIMIT_FSIZE, &full);
  const auto refused = write_file(path, std::string(100'000, 'x'));
  ::setrlimit(RLIMIT_FSIZE, &limit);
  REQUIRE_FALSE(refused.has_value());
  CHECK(refused.error().what ==
        path.string() + ": cannot be written: larger than this user's files may be (ulimit -f)");
  CHECK(text_of(path) == "before");
  CHECK(files_in(folder.path()) == 1);  // nor does half a file stay beside it
}

TEST_CASE("a folder that is not there is told by the file's path") {
  const hal::TemporaryFolder folder;
  const auto refused = write_file(folder.file("none/summary.json"), "x");
  REQUIRE_FALSE(refused.has_value());
  CHECK(refused.error().what == folder.file("none/summary.json") +
                                    ": cannot be written: there is no folder " + folder.file("none") +
                                    "; make it first");
}

TEST_CASE("a surface as JSON: unit, frame, degree, knots, and the net row by row along u") {
  geometry::BSplineSurface s;
  s.knots_u = geometry::uniform_clamped_knots(2);
  s.knots_v = geometry::uniform_clamped_knots(1);
  for (auto* net : {&s.x, &s.y, &s.z}) net->resize(5, 4);
  for (int i = 0; i < 5; ++i) {
    for (int k = 0; k < 4; ++k) {
      s.x(i, k) = i;
      s.y(i, k) = 10 * k;
      s.z(i, k) = 0.1 * i + k / 3.0;
    }
  }
  const Json j = Json::parse(surface_json(s).dump());
  CHECK(j["schema"] == 1);
  CHECK(j["unit"] == "mm");
  CHECK(j["frame"] == "world");
  CHECK(j["degree"] == Json({3, 3}));
  CHECK(j["knots_u"] == Json({0.0, 0.0, 0.0, 0.0, 0.5, 1.0, 1.0, 1.0, 1.0}));
  CHECK(j["knots_v"].size() == 8);
  REQUIRE(j["control"].size() == 5);
  REQUIRE(j["control"][0].size() == 4);
  for (std::size_t i = 0; i < 5; ++i) {
    for (std::size_t k = 0; k < 4; ++k) {
      const auto point = j["control"][i][k];
      CHECK(point[0].get<double>() == static_cast<double>(i));
      CHECK(point[1].get<double>() == 10.0 * static_cast<double>(k));
      CHECK(point[2].get<double>() ==
            s.z(static_cast<int>(i), static_cast<int>(k)));  // no digit is lost on the way
    }
  }
}

TEST_CASE("the result table shows what the summary holds, and leaves out what it does not") {
  Json s = {{"result", "complete"},
            {"shots", {{"seek", 2}, {"boundary", 14}, {"surface", 16}, {"retaken", 1}}},
            {"points", {{"total", 1600000}, {"used", 794087}}},
            {"boundary",
             {{"corners_mm", {{692.931, 115.07}, {415.38, 241.23}, {289.12, -36.51}, {566.86, -162.65}}}}},
            {"surface", {{"control_points", {7, 7}}, {"sigma_mm", 0.0509}, {"shot_offset_rms_mm", 0.0147}}},
            {"cycle", {{"seconds", 17.71}, {"standing_fraction", 0.18}, {"idle_fraction", 0.044}}}};
  const std::string table = result_table(s, "out/run-1");
  CHECK(table.find("shots                       2 seeking, 14 boundary, 16 surface, 1 retaken\n") !=
        std::string::npos);
  CHECK(table.find("points used                 794087 of 1600000\n") != std::string::npos);
  CHECK(table.find("(692.93, 115.07) (415.38, 241.23)") != std::string::npos);
  CHECK(table.find("7 x 7 control points\n") != std::string::npos);
  CHECK(table.find("cell time, s                17.7 (arm standing 18 %, idle 4.4 %)\n") !=
        std::string::npos);
  CHECK(table.find("run folder                  out/run-1\n") != std::string::npos);
  CHECK(table.find("truth") == std::string::npos);
  s["truth"] = {{"normal_rms_mm", 0.0015},
                {"normal_max_mm", 0.0075},
                {"outline_max_mm", 0.083},
                {"corner_max_mm", 0.073}};
  CHECK(result_table(s, "").find("normal rms 0.0015, max 0.0075; outline max 0.083; corner max 0.073\n") !=
        std::string::npos);
}
