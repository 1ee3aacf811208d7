// What no key can say alone, and how a file with several errors is told.
#include "firmware_like/config/config_rules.hpp"

#include "firmware_like/config/config.hpp"
#include "hal/temporary_folder.hpp"

#include <doctest/doctest.h>
#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <sstream>
#include <vector>

using namespace moldloft;
using namespace moldloft::firmware_like;

namespace {

// "error 3 [scanner] host: ..." for each finding.
std::vector<std::string> told(const std::string& text) {
  std::vector<std::string> lines;
  for (const auto& f : examine_config(text, "cell.toml").findings)
    lines.push_back(
        fmt::format("{} {} {}", f.severity == Severity::error ? "error" : "warning", f.line, f.what));
  return lines;
}

// The only finding of a text, which must begin so.
bool alone(const std::string& text, const std::string& begins) {
  const auto lines = told(text);
  const bool good = lines.size() == 1 && lines.front().starts_with(begins);
  if (!good) {
    for (const auto& line : lines) MESSAGE(line);
  }
  return good;
}

std::string refusal(const std::string& text) {
  const auto config = parse_config(text, "cell.toml");
  return config ? "" : config.error().what;
}

}  // namespace

TEST_CASE("the defaults and an empty file contradict nothing, and look like no slip") {
  CHECK(told("").empty());
  CHECK(told("\n").empty());
  CHECK(told("\xEF\xBB\xBF# with a byte order mark\r\n[robot]\r\nbaud\t=\t9600\r\n").empty());
  CHECK(contradictions(default_config()).empty());
}

TEST_CASE(
    "values that contradict each other are errors, with the line of the first that stands in the file") {
  CHECK(alone("[robot]\nspeed_percent = 80\n[robot.workspace]\nmax_speed_percent = 50\n",
              "error 2 [robot] speed_percent: 80 is over [robot.workspace] max_speed_percent, 50"));
  CHECK(alone("\n[robot.workspace]\nmax_speed_percent = 50\n", "error 3 [robot] speed_percent: 100 is over"));
  CHECK(alone("[start]\ncentre_mm = [5000, 0, 10]\n",
              "error 2 [start] centre_mm: target outside the workspace: x 5000.0 mm"));
  CHECK(alone("[start]\ncentre_mm = [0, 0, 10]\n",
              "error 2 [start] centre_mm: target outside the workspace: reach 140.0 mm"));
  CHECK(alone("[robot.workspace]\nz_mm = [400, 600]\n",
              "error 2 [start] centre_mm: target outside the workspace: z 310.0 mm"));
  CHECK(alone("[start]\ncentre_mm = [500, 0, -60]\n",
              "error 2 [start] centre_mm: z -60 with [scanner] depth_mm 60 ends at 0 mm"));
  CHECK(told("[robot.workspace]\nreach_mm = [300, 300]\n").front() ==
        "error 2 [robot.workspace] reach_mm: from 300 to 300 leaves the arm no room");
  const auto step = told("[tracking]\nseek_step_mm = 90\n[robot.workspace]\nmax_step_mm = 80\n");
  REQUIRE_FALSE(step.empty());
  CHECK(step.front() == "error 2 [tracking] seek_step_mm: 90 is over [robot.workspace] max_step_mm, 80");
  const auto empty =
      told("[robot.workspace]\nx_mm = [-100, 100]\ny_mm = [-100, 100]\nreach_mm = [200, 800]\n");
  CHECK(std::ranges::count_if(empty, [](const auto& l) {
          return l.starts_with("error 4 [robot.workspace] reach_mm: 200 to 800 has nothing in common");
        }) == 1);
}

TEST_CASE("a host that has a port in it, or is a URL, is empty or has a blank, is refused") {
  for (const char* host : {"10.0.0.7:4014", "localhost:4014", "[::1]:4014", "[::1]", "http://10.0.0.7", "",
                           "10.0.0.7 ", "a b"}) {
    CAPTURE(host);
    CHECK(alone(fmt::format("[scanner]\nhost = \"{}\"\n", host), "error 2 [scanner] host: "));
  }
  for (const char* host : {"10.0.0.7", "::1", "fe80::1", "scanner", "localhost"}) {
    CAPTURE(host);
    CHECK(told(fmt::format("[scanner]\nhost = \"{}\"\n", host)).empty());
  }
}

TEST_CASE("a scanner whose frames fit through its serial line in time is not warned of") {
  CHECK(told("[scanner]\nlink = \"serial\"\ndevice = \"/dev/ttyS9\"\nbaud = 921600\nmax_stripes = 50\n")
            .empty());
  CHECK(told("[scanner]\nbaud = 1200\n").empty());  // the link is a socket
}

TEST_CASE("values that look like a slip are warnings, and a run takes them") {
  const auto warns = [](const std::string& text, const std::string& begins) {
    CHECK(refusal(text) == "");
    const auto lines = told(text);
    CAPTURE(text);
    CHECK_MESSAGE(
        std::ranges::any_of(lines, [&](const auto& l) { return l.starts_with("warning " + begins); }),
        (lines.empty() ? "nothing" : lines.front()));
  };
  warns("[scanner]\nlink = \"serial\"\ndevice = \"/dev/ttyS9\"\nbaud = 921600\n",
        "4 [scanner] baud: a frame of 35");  // 100 stripes of 500 points take 3.8 s
  warns("[scanner.mount]\ntranslation_mm = [0, 0.14, 0.3]\n[robot.workspace]\nz_mm = [0, 600]\n",
        "2 [scanner.mount] translation_mm: the scanner sits 0.331 mm from the tip; metres?");
  warns("[scanner.mount]\nzyz_deg = [0, 3.14159, 3.14159]\n", "2 [scanner.mount] zyz_deg: ");
  warns("[robot]\nbaud = 115000\n", "2 [robot] baud: 115000 is no usual rate");
  warns("[plate]\nlargest_mm = [80, 80]\n",
        "2 [plate] largest_mm: 80 x 80 is smaller than [scanner] field_mm");
  warns("[tracking]\nseek_step_mm = 150\n", "2 [tracking] seek_step_mm: 150 is more than [scanner] field_mm");
  warns("[tracking]\nseek_limit_mm = 50\n", "2 [tracking] seek_limit_mm: 50 is less than one seek_step_mm");
  warns("[fit]\ntolerance_mm = 0.5\n", "2 [fit] tolerance_mm: 0.5 is more than [scanner] noise_mm");
  warns("[robot.workspace]\nmax_step_mm = 300\n",
        "2 [robot.workspace] max_step_mm: 300 is less than the way");
  warns("[start]\ncentre_mm = [500, 0, 100]\n",
        "2 [start] centre_mm: z 100 with [scanner] depth_mm 60 begins at 40");
  warns("[scan]\nmargin_mm = 60\n", "2 [scan] margin_mm: 60 is more than half");
  warns("[fit]\nfinest_span_mm = 100\n", "2 [fit] finest_span_mm: 100");
}

TEST_CASE("a start that only the head's opposite heading can look at is none outside the workspace") {
  CHECK(told("[robot.workspace]\ny_mm = [-800, 50]\n").empty());  // the tip at y -140 instead of 140
  CHECK(told("[robot.workspace]\ny_mm = [-50, 50]\n")
            .front()
            .starts_with("error 2 [start] centre_mm: target outside the workspace: y 140.0 mm"));
}

TEST_CASE("a mount that is only tilted is none in radians") {
  CHECK(told("[scanner.mount]\nzyz_deg = [3, 178, 182]\n").empty());
  CHECK(told("[scanner.mount]\nzyz_deg = [180, 180, 0]\n[start]\ncentre_mm = [500, 100, 10]\n").empty());
}

TEST_CASE("all errors of a file are told, each with its line, in the order of the lines") {
  CHECK(
      refusal(
          "[robot]\nbaud = 1\nbuad = 2\n[scanner]\nport = 0\nhost = \"a:1\"\n[plate]\nthickness_mm = -1\n") ==
      "cell.toml:2: [robot] baud: 1 is outside 1200 to 921600\n"
      "cell.toml:3: [robot] buad: unknown key; known here: arrival_deg, arrival_mm, baud, device, driver, "
      "host, link, port, "
      "repeatability_z_mm, "
      "speed_percent, workspace\n"
      "cell.toml:5: [scanner] port: 0 is outside 1 to 65535\n"
      "cell.toml:6: [scanner] host: 'a:1' has a port in it; write the address alone, and the port into port\n"
      "cell.toml:8: [plate] thickness_mm: -1 is outside 0.5 to 200");
}

TEST_CASE("a rule says nothing of a key whose own value is wrong") {
  CHECK(alone("[start]\ncentre_mm = [5000, 0, \"x\"]\n", "error 2 [start] centre_mm: an array of 3 numbers"));
  CHECK(alone("[robot]\nspeed_percent = 400\n[robot.workspace]\nmax_speed_percent = 50\n",
              "error 2 [robot] speed_percent: 400 is outside 1 to 100"));
  CHECK(
      alone("[robot]\nspeed_percent = 40\nworkspace = 3\n", "error 3 [robot] workspace: a table is wanted"));
}

TEST_CASE(
    "lines that are no TOML are passed over where they stand for themselves, so that later errors are "
    "found") {
  const auto lines =
      told("[robot]\nbaud 9600\nspeed_percent = 100\nspeed_percent = 50\n[scanner]\nport = 0\n");
  REQUIRE(lines.size() == 3);
  CHECK(lines[0].starts_with("error 2 "));
  CHECK(lines[1].starts_with("error 4 "));
  CHECK(lines[2] == "error 6 [scanner] port: 0 is outside 1 to 65535");
  // After half a table's name the keys would be read for another table's.
  CHECK(told("[robot\nbaud = 1\n").size() == 1);
  CHECK(told("[robot]\nbaud = [\n9600\nspeed = 4\nspeed_percent = 3\n[scanner]\nport = 0\n").size() == 1);
  CHECK(told("[cell]\nname = \"[\"  # ]] [\nname 3\n[scanner]\nport = 0\n").size() == 2);
  CHECK(told("a = 1\n[robot]\n[robot]\nbaud = 1\n").size() == 1);
}

TEST_CASE("a file in another encoding is told so with the line") {
  CHECK(
      alone("# 61 \xB0"
            "C\n",
            "error 1 byte 0xB0 is not UTF-8; save the file as UTF-8, or write ASCII"));
  CHECK(
      alone("[cell]\nname = \"S\xFC"
            "d\"\n",
            "error 2 byte 0xFC is not UTF-8"));
  CHECK(alone(std::string("\xFF\xFE[\0c\0", 6), "error 1 is UTF-16; save the file as UTF-8"));
}

TEST_CASE("a directory, a missing file and what never ends are told apart") {
  const hal::TemporaryFolder folder;
  const auto why = [](const std::string& path) {
    const auto config = load_config(path);
    return config ? "" : config.error().what;
  };
  CHECK(why(folder.path().string()) ==
        folder.path().string() + ": is a directory; give the path of a cell configuration");
  CHECK(why(folder.file("none.toml")) ==
        folder.file("none.toml") +
            ": cannot be read: No such file or directory; give the path of a cell "
            "configuration");
  CHECK(why("/dev/zero") == "/dev/zero: has more than 1 MiB; give the path of a cell configuration");
  CHECK(why("/dev/null") == "");  // an empty file: the defaults
}
