// Each rule on wings is seen failing on what breaks it, and silent on the nearest that does not.
#include "tree/wing_rules.hpp"

#include <doctest/doctest.h>

using namespace moldloft::tree;

namespace {

const std::string hal_cmake =
    "# a comment with moldloft_wing(hal none)\n"
    "moldloft_wing(hal base PUBLIC fmt::fmt)\n"
    "moldloft_wing(hal links PUBLIC moldloft::hal_base\n  PRIVATE Threads::Threads)\n"
    "moldloft_wing(hal record PUBLIC moldloft::hal_links PRIVATE SQLite::SQLite3)\n"
    "moldloft_room(hal)\n";

std::string include(const std::string& name) { return "#include \"" + name + "\"\n"; }

}  // namespace

TEST_CASE("wings are read from the lines that build them") {
  const auto wings = wings_in(hal_cmake);
  REQUIRE(wings.size() == 3);
  CHECK(wings[0].room == "hal");
  CHECK(wings[0].name == "base");
  CHECK(wings[0].links.empty());
  CHECK(wings[1].links == std::vector<std::string>{"base"});
  CHECK(wings[2].links == std::vector<std::string>{"links"});
}

TEST_CASE("an include against an arrow between wings is found, one along it is not") {
  const auto wings = wings_in(hal_cmake);
  CHECK(wing_include_findings("hal/base/clock.cpp", include("hal/record/recorder.hpp"), wings) ==
        Findings{"hal/base/clock.cpp:1: includes hal/record/recorder.hpp, and hal/CMakeLists.txt does not "
                 "let base see it"});
  CHECK(wing_include_findings("hal/links/a.hpp", include("hal/record/recorder.hpp"), wings).size() == 1);
  CHECK(wing_include_findings("hal/links/a.hpp", include("hal/base/clock.hpp"), wings).empty());
  CHECK(wing_include_findings("hal/record/a.hpp", include("hal/base/clock.hpp"), wings)
            .empty());  // by way of links
  CHECK(wing_include_findings("hal/base/a.hpp", include("hal/base/clock.hpp"), wings).empty());
  CHECK(wing_include_findings("hal/base/a.hpp", include("hal/clock.hpp"), wings).size() == 1);  // in no wing
  CHECK(wing_include_findings("tests/hal/a.cpp", include("hal/record/a.hpp"), wings).empty());
}

TEST_CASE("a room that other programs include from has files on its ground, seen by all its wings") {
  const auto wings = wings_in(
      "moldloft_wing(geometry splines OBJECT PUBLIC moldloft::geometry_ground)\n"
      "moldloft_wing(geometry cad OBJECT PUBLIC moldloft::geometry_ground)\n");
  CHECK(wing_order_findings(wings).empty());
  CHECK(wing_include_findings("geometry/cad/a.cpp", include("geometry/error.hpp"), wings).empty());
  CHECK(wing_include_findings("geometry/cad/a.cpp", include("geometry/splines/a.hpp"), wings).size() == 1);
  CHECK(wing_content_findings(std::vector<std::string>{"geometry/error.hpp"}, wings).empty());
  CHECK(wing_content_findings(std::vector<std::string>{"geometry/other/a.hpp"}, wings).size() == 1);
}

TEST_CASE("a circle of wings, a link to nowhere and a seventh floor are found") {
  CHECK(wing_order_findings(wings_in(hal_cmake)).empty());
  const auto circle =
      wings_in("moldloft_wing(hal a PUBLIC moldloft::hal_b)\nmoldloft_wing(hal b PRIVATE moldloft::hal_a)\n");
  CHECK(wing_order_findings(circle).size() == 2);
  CHECK(wing_order_findings(wings_in("moldloft_wing(hal a PUBLIC moldloft::hal_b)\n")) ==
        Findings{"hal/a: links b, which is no wing of the room"});
  std::string tower = "moldloft_wing(hal w1)\n";
  for (int i = 2; i <= 6; ++i)
    tower +=
        "moldloft_wing(hal w" + std::to_string(i) + " PUBLIC moldloft::hal_w" + std::to_string(i - 1) + ")\n";
  CHECK(wing_order_findings(wings_in(tower)).empty());
  tower += "moldloft_wing(hal w7 PUBLIC moldloft::hal_w6)\n";
  CHECK(wing_order_findings(wings_in(tower)) == Findings{"hal/w7: on floor 7, 6 is the most"});
}

TEST_CASE("a source outside the wings and a folder of 21 components are found") {
  const auto wings = wings_in(hal_cmake);
  CHECK(
      wing_content_findings(std::vector<std::string>{"hal/base/a.hpp", "hal/README.md", "tasks/a.cpp"}, wings)
          .empty());
  CHECK(wing_content_findings(std::vector<std::string>{"hal/a.hpp"}, wings) ==
        Findings{"hal/a.hpp: stands in no wing of its room"});
  std::vector<std::string> many;
  for (int i = 0; i < 20; ++i) {
    many.push_back("hal/base/a" + std::to_string(i) + ".hpp");
    many.push_back("hal/base/a" + std::to_string(i) + ".cpp");
  }
  CHECK(wing_content_findings(many, wings).empty());
  many.push_back("hal/base/b.hpp");
  CHECK(wing_content_findings(many, wings) == Findings{"hal/base: 21 components, 20 is the most"});
}
