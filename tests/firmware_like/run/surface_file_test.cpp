#include "firmware_like/run/surface_file.hpp"

#include "firmware_like/process/whole_file.hpp"
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
