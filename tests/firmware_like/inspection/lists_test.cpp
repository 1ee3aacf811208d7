// Lists that other programs print: points and template heights, in whatever shape they come.
#include "firmware_like/inspection/point_list.hpp"
#include "firmware_like/inspection/template_list.hpp"
#include "firmware_like/inspection/text_fields.hpp"

#include <doctest/doctest.h>
#include <fmt/format.h>

#include <algorithm>

using namespace moldloft::firmware_like;

namespace {

std::string repeated(const std::function<std::string(int)>& line, int count = 8) {
  std::string text;
  for (int i = 0; i < count; ++i) text += line(i);
  return text;
}

constexpr const char* own_list =
    "Heights for flexible templates  PLATE= T-12  DISTANCE BETWEEN COLUMNS= 250\n"
    "LIMITS= F7-100 -- F9+150  BASE= F8\n"
    "\n"
    "FRAME      -2    -1     0     1     2   LOWER   UPPER   SIGHT   ANGLE\n"
    "F7         28     7     0     7    28     500     500       3    90.0\n"
    "F8                8     0     6           300     310       0    90.0\n"
    "F9         32     9     0     5    24     500     500      -3    90.0\n"
    "\n"
    "MIDDLE POINTS\n"
    "FRAME      F7     F8     F9\n"
    "X        1000   1600   2200\n"
    "Y           0      0      0\n"
    "Z          12     10     14\n";

}  // namespace

TEST_CASE("points in every shape in which machines write them are the same points") {
  struct Shape {
    const char* of;
    std::string text;
  };
  const auto number = [](double x, char decimal) {
    std::string text = fmt::format("{:.3f}", x);
    std::ranges::replace(text, '.', decimal);
    return text;
  };
  const auto lines = [&](std::string_view pattern, char decimal = '.', const char* head = "") {
    return std::string{head} + repeated([&](int i) {
             return fmt::format(fmt::runtime(std::string{pattern} + "\n"), number(10.5 * i, decimal),
                                number(-2.25 * i, decimal), number(1.125, decimal), i + 1);
           });
  };
  const Shape shapes[] = {
      {"xyz", lines("{0} {1} {2}")},
      {"tabs", lines("{0}\t{1}\t{2}")},
      {"csv", lines("{0},{1},{2}", '.', "x,y,z\n")},
      {"semicolons and decimal commas", lines("{0};{1};{2}", ',', "X;Y;Z\n")},
      {"blanks and decimal commas", lines("{0}  {1}  {2}", ',')},
      {"POINT", lines("POINT,{0},{1},{2},0,0,1")},
      {"DMIS-like names", lines("P{3} {0} {1} {2}")},
      {"numbered", lines("{3} {0} {1} {2}", '.', "# made by hand\n// twice\n")},
      {"normals behind", lines("{0} {1} {2} 0 0 1")},
      {"a mark and CR LF", "\xEF\xBB\xBF" + lines("{0};{1};{2}\r", ',')},
      {"other columns first", lines("{1},{0},{2}", '.', "Y [mm],X [mm],Z [mm]\n")},
      {"a quoted head", lines("9;;{2};{0};{1}", ',', "\"pin\";\"\";\"Z\";\"X\";\"Y\"\n")},
      {"numbers with gaps", lines("7{3}0,{0},{1},{2}", '.', "id,x,y,z\n")},
      {"a head of other lines", lines("{0} {1} {2}", '.', "y x z of plate 7\n")},
      {"Fortran's powers", lines("{0}D+00 {1}D+00 {2}d+00")},
      {"plus signs", lines("+{0} {1} +{2}")}};
  for (const auto& shape : shapes) {
    CAPTURE(shape.of);
    const auto list = read_points(shape.text, "p");
    REQUIRE_MESSAGE(list.has_value(), list.error().what);
    REQUIRE(list->points.size() == 8);
    CHECK((list->points[3] - Eigen::Vector3d{31.5, -6.75, 1.125}).norm() < 1e-9);
    CHECK(list->mm_per_unit.value_or(1.0) == 1.0);
  }
}

TEST_CASE("a unit is taken from where it stands") {
  const auto body = repeated([](int i) { return fmt::format("{} 2 3\n", i); });
  CHECK(read_points("# unit mm\n" + body, "p")->mm_per_unit == 1.0);
  CHECK(read_points("x [in] y [in] z [in]\n" + body, "p")->mm_per_unit == 25.4);
  CHECK(read_points("units: m\n" + body, "p")->mm_per_unit == 1000.0);
  CHECK(read_points("Inches\n" + body, "p")->mm_per_unit == 25.4);
  CHECK_FALSE(read_points("measured in a hurry, by M\n" + body, "p")->mm_per_unit);
  CHECK(mm_per_unit_named("Inch") == 25.4);
  CHECK_FALSE(mm_per_unit_named("furlong"));
}

TEST_CASE("lines that are no points are refused by their number") {
  const auto body = repeated([](int i) { return fmt::format("{}.5 2 3\n", i); });
  const struct {
    std::string text, says;
  } wrong[] = {{"", "0 points"},
               {"1 2 3\n4 5 6\n", "2 points"},
               {body + "hello\n", "line 9 holds no point"},
               {body + "1 2\n", "line 9 holds no point"},
               {body + "1 2 3 4\n", "line 9 has 4 numbers"},
               {body + "nan 2 3\n", "line 9"},
               {body + "1e12 2 3\n", "line 9: a coordinate beyond"},
               {std::string("a\0b", 3), "is no text"}};
  for (const auto& w : wrong) {
    CAPTURE(std::string{w.says});
    const auto list = read_points(w.text, "p.xyz");
    REQUIRE_FALSE(list);
    CHECK(list.error().what.starts_with("p.xyz: "));
    CHECK(list.error().what.find(w.says) != std::string::npos);
    CHECK(list.error().what.find('\n') == std::string::npos);
  }
}

TEST_CASE("a template list: frames, pins below their columns, seams and middle points") {
  REQUIRE(looks_like_templates(own_list));
  const auto list = read_templates(own_list, "t");
  REQUIRE_MESSAGE(list.has_value(), list.error().what);
  CHECK(list->plate == "T-12");
  CHECK(list->distance_mm == 250);
  REQUIRE(list->frames.size() == 3);
  const auto& middle = list->frames[1];
  CHECK(middle.name == "F8");
  REQUIRE(middle.pins.size() == 3);
  CHECK(middle.pins[0].column == -1);
  CHECK(middle.pins[2].height_mm == 6);
  CHECK(middle.lower_mm == 300.0);
  CHECK(middle.place(middle.pins[0], 250) == Eigen::Vector3d{1600, -250, 18});
  CHECK(list->before_first_mm == 100.0);
  CHECK(list->after_last_mm == 150.0);
}

TEST_CASE("the same list with other separators, decimals, capitals and in two tables is the same list") {
  std::string semicolons =
      "TEMPLATES;PLATE= T-12;DISTANCE BETWEEN COLUMNS= 250\n"
      "Frame;-2;-1;0;1;2;Lower;Upper;Sight;Angle\n"
      "F7;28,5;7;0;7;28;500;500;3;90,0\nF8;;8;0;6;;300;310;0;90,0\nF9;32;9;0;5;24;500;500;-3;90,0\n"
      "Middle points\nFrame;F7;F8;F9\nX;1000;1600;2200\nY;0;0;0\nZ;12;10;14\n";
  auto list = read_templates(semicolons, "t");
  REQUIRE_MESSAGE(list.has_value(), list.error().what);
  CHECK(list->frames[1].pins.size() == 3);
  CHECK(list->frames[0].pins[0].height_mm == 28.5);

  const std::string two_tables =
      "HEIGHTS FOR FLEXIBLE TEMPLATES PLATE= T DISTANCE BETWEEN COLUMNS= 250\n"
      "FRAME  -1 0 1\nF7 7 0 7\nF8 8 0 6\nFRAME  2 3\nF7 28 60\nF8 20 50\n"
      "MIDDLE POINTS\nFRAME F7 F8\nX 1000 1600\nY 0 0\nZ 1 2\n";
  list = read_templates(two_tables, "t");
  REQUIRE_MESSAGE(list.has_value(), list.error().what);
  REQUIRE(list->frames[0].pins.size() == 5);
  CHECK(list->frames[1].pins[4].height_mm == 50);
}

TEST_CASE("measured minus nominal comes out in the shape in which the list came in") {
  const auto list = read_templates(own_list, "t");
  REQUIRE(list);
  const std::vector<std::vector<std::optional<double>>> differences{
      {0.0, -1.25, 0.5, 12.5, std::nullopt}, {1.0, 2.0, -3.0}, {0.1, 0.2, 0.3, 0.4, -100.0}};
  const std::string out = with_differences(*list, differences);
  const auto before = lines_of(own_list), after = lines_of(out);
  REQUIRE(before.size() == after.size());
  CHECK(after[0] == before[0]);
  CHECK(after[3] == before[3]);
  CHECK(after[4].ends_with(before[4].substr(before[4].find("500"))));
  const auto fields = fields_of(after[4]);
  CHECK(fields[1].text == "0.0");
  CHECK(fields[4].text == "12.5");
  CHECK(fields[5].text == "-");
  // Read again as a list it has the differences for heights.
  const auto again =
      read_templates(with_differences(*list, {{1, 2, 3, 4, 5}, {1, 2, 3}, {1, 2, 3, 4, 5}}), "again");
  REQUIRE_MESSAGE(again.has_value(), again.error().what);
  CHECK(again->frames[1].pins[2].height_mm == 3);
  CHECK(again->frames[1].pins[2].column == 1);
}

TEST_CASE("a template list that is not whole is refused, with line or frame") {
  const auto changed = [](std::string_view from, std::string_view to) {
    std::string text = own_list;
    text.replace(text.find(from), from.size(), to);
    return text;
  };
  const struct {
    std::string text, says;
  } wrong[] = {{changed("DISTANCE BETWEEN COLUMNS= 250", ""), "DISTANCE BETWEEN COLUMNS"},
               {changed("MIDDLE POINTS", "LAST POINTS"), "line 9"},
               {changed("X        1000", "X         abc"), "line 11"},
               {changed("F9         32", "F9        3x2"), "line 7"},
               {changed("F8     F9\nX", "F8    F10\nX"), "F10"},
               {changed("1600   2200", "1000   2200"), "same X"},
               {changed("Z          12     10", "Z                 10"), "coordinates for"},
               {changed("F7         28", "F7      99999"), "cannot be"},
               {std::string{own_list}.substr(0, 260), "two frames"}};
  for (const auto& w : wrong) {
    CAPTURE(std::string{w.says});
    const auto list = read_templates(w.text, "t.txt");
    REQUIRE_FALSE(list);
    CAPTURE(list.error().what);
    CHECK(list.error().what.starts_with("t.txt"));
    CHECK(list.error().what.find(w.says) != std::string::npos);
  }
}
