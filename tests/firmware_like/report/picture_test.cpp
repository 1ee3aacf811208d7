// The overview is read back from its SVG: where texts and lines stand, and that none stands on another.
#include "firmware_like/report/picture.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <regex>

using namespace moldloft;
using namespace moldloft::firmware_like;

namespace {

// A flat plate of the given sides with its lower left corner at the origin, turned about it.
geometry::BSplineSurface plate(double width, double height, double turn = 0) {
  geometry::BSplineSurface s;
  s.knots_u = s.knots_v = geometry::uniform_clamped_knots(1);
  s.x = s.y = s.z = Eigen::MatrixXd::Zero(4, 4);
  for (int i = 0; i < 4; ++i) {
    for (int j = 0; j < 4; ++j) {
      const double x = width * i / 3, y = height * j / 3;
      s.x(i, j) = std::cos(turn) * x - std::sin(turn) * y;
      s.y(i, j) = std::sin(turn) * x + std::cos(turn) * y;
    }
  }
  return s;
}

PlateField ramp(const char* title) {
  PlateField field{.count_u = 8, .count_v = 8, .values = {}, .title = title, .unit = "mm"};
  for (int i = 0; i < 64; ++i) field.values.push_back(i - 31.5);
  return field;
}

struct Text {
  double x = 0, y = 0;
  std::string words;
  double height = 15;
  // Sans-serif is at most 0.56 em wide on average over a line of words.
  double right() const { return x + 0.56 * height * static_cast<double>(words.size()); }
};

struct Paper {
  double width = 0, height = 0;
  std::vector<Text> texts;
  double leftmost = 1e9, rightmost = -1e9, top = 1e9, bottom = -1e9;  // of what is drawn by paths and circles

  explicit Paper(const std::string& svg) {
    std::smatch m;
    REQUIRE(std::regex_search(svg, m, std::regex{"viewBox='0 0 ([0-9]+) ([0-9]+)'"}));
    width = std::stod(m[1]);
    height = std::stod(m[2]);
    const std::regex text{"<text x='([-0-9.]+)' y='([-0-9.]+)'([^>]*)>([^<]*)</text>"};
    for (std::sregex_iterator it{svg.begin(), svg.end(), text}, end; it != end; ++it) {
      const bool is_title = (*it)[3].str().find("title") != std::string::npos;
      texts.push_back({std::stod((*it)[1]), std::stod((*it)[2]), (*it)[4], is_title ? 20.0 : 15.0});
    }
    const std::regex point{"[ML]([-0-9.]+) ([-0-9.]+)"};
    for (std::sregex_iterator it{svg.begin(), svg.end(), point}, end; it != end; ++it) {
      leftmost = std::min(leftmost, std::stod((*it)[1]));
      rightmost = std::max(rightmost, std::stod((*it)[1]));
      top = std::min(top, std::stod((*it)[2]));
      bottom = std::max(bottom, std::stod((*it)[2]));
    }
  }

  const Text& starting_with(const std::string& words) const {
    for (const auto& t : texts) {
      if (t.words.starts_with(words)) return t;
    }
    FAIL("no text starts with ", words);
    return texts.front();
  }
};

void check_order(const Paper& paper) {
  CHECK(paper.leftmost >= 0);
  CHECK(paper.top >= 0);
  CHECK(paper.rightmost <= paper.width);
  CHECK(paper.bottom <= paper.height);
  for (const auto& a : paper.texts) {
    CAPTURE(a.words);
    CHECK(a.y <= paper.height);
    CHECK(a.right() <= paper.width);
    for (const auto& b : paper.texts) {
      if (&a == &b || std::abs(a.y - b.y) >= 13) continue;  // other lines
      CAPTURE(b.words);
      CHECK((a.right() <= b.x || b.right() <= a.x));
    }
  }
  CHECK(paper.starting_with("black:").y > paper.bottom);  // under everything that is drawn
}

OverviewInput input(const geometry::BSplineSurface& surface, std::size_t panels) {
  OverviewInput in{.title = "Moldloft run: saddle (seed 1)", .subtitle = "complete", .surface = &surface};
  if (panels > 0) in.fields.push_back(ramp("Shape"));
  if (panels > 1) in.fields.push_back(ramp("Deviation"));
  return in;
}

}  // namespace

TEST_CASE("no line of the overview stands on another, whatever the plate's shape and the number of panels") {
  for (const auto& surface : {plate(300, 300), plate(300, 300, 0.4), plate(1400, 200), plate(200, 1400)}) {
    for (const std::size_t panels : {1u, 2u}) {
      CAPTURE(panels);
      check_order(Paper{overview_svg(input(surface, panels))});
    }
  }
}

TEST_CASE(
    "panels stand one under the other in the width of a sheet, so that letters stay readable when it is "
    "narrow") {
  for (const auto& surface : {plate(300, 300), plate(1400, 200), plate(200, 1400)}) {
    const std::string svg = overview_svg(input(surface, 2));
    const Paper paper{svg};
    CHECK(paper.starting_with("Shape").x == paper.starting_with("Deviation").x);
    CHECK(paper.starting_with("Shape").y < paper.starting_with("Deviation").y);
    // At 400 px a letter of 15 px has 9, and the two panels fit on a sheet of A4 less its margins.
    CHECK(15 * 400 / paper.width >= 9);
    CHECK(paper.height / paper.width <= 2.0);
    CHECK(svg.find("max-width:100%") != svg.npos);  // never wider than the window: nothing is cut off
    CHECK(svg.find("@page{size:A4") != svg.npos);
  }
}

TEST_CASE("long lines of the head are broken, never cut off, and push the drawing down") {
  const auto surface = plate(300, 300);
  auto in = input(surface, 2);
  const double before = Paper{overview_svg(in)}.top;
  in.title = "Moldloft run: shell plate 17 of the bulbous bow, port side, second pass after heating";
  in.subtitle = "held: " + std::string(150, 'w') +
                " \xC3\xBC\xC3\xBC\xC3\xBC, and what to do is told here in a long sentence";
  const std::string svg = overview_svg(in);
  const Paper paper{svg};
  check_order(paper);
  CHECK(paper.top > before);
  std::string all;
  for (const auto& t : paper.texts) all += t.words + " ";
  for (const char* word : {"bulbous", "heating", "\xC3\xBC\xC3\xBC\xC3\xBC,", "sentence"})
    CHECK(all.find(word) != all.npos);
}

TEST_CASE("the fields of boundary shots do not widen the view once the surface has been shot") {
  const auto surface = plate(300, 300);
  const std::vector<tasks::ShotPlace> corner{{.centre = {0, 0, 0}, .head_yaw = 0.785}};
  const std::vector<tasks::ShotPlace> middle{{.centre = {150, 150, 0}, .head_yaw = 0}};
  auto in = input(surface, 1);
  in.surface_places = middle;
  const std::string without = overview_svg(in);
  in.boundary_places = corner;
  const Paper paper{overview_svg(in)};
  CHECK(paper.height == Paper{without}.height);
}

TEST_CASE("a run that was held before it had a surface shows its edge points and how far the tracker came") {
  const std::vector<Eigen::Vector2d> edges{{100, 0}, {100, 50}, {101, 90}};
  const std::vector<tasks::ShotPlace> path{{.centre = {0, 20, 0}}, {.centre = {90, 20, 0}}};
  OverviewInput in{.title = "Moldloft run: plate 17", .subtitle = "held"};
  check_order(Paper{overview_svg(in)});  // nothing at all
  in.boundary_places = path;
  in.edge_points = edges;
  const std::string svg = overview_svg(in);
  check_order(Paper{svg});
  CHECK(Paper{svg}.starting_with("black:").words.find("edge points") != std::string::npos);
  CHECK(svg.find("NaN") == std::string::npos);
  CHECK(svg.find("nan") == std::string::npos);
}

TEST_CASE("a plate's name stands in the picture as it was given, and no name breaks it") {
  const auto surface = plate(300, 300);
  const auto title = [&](const char* text) {
    auto in = input(surface, 1);
    in.title = text;
    return Paper{overview_svg(in)}.texts.front().words;
  };
  CHECK(title("Moldloft run: Hull 7/plate 12") == "Moldloft run: Hull 7/plate 12");
  CHECK(title("Moldloft run: a<b>&c") == "Moldloft run: a&lt;b&gt;&amp;c");
}

TEST_CASE("whose run it is stands under the title, in as many lines as it needs") {
  const auto surface = plate(300, 300);
  auto in = input(surface, 1);
  in.about = "plate 17; cell loft; remark: a < b";
  const std::string svg = overview_svg(in);
  const Paper head{svg};
  check_order(head);
  CHECK(head.starting_with("Moldloft run").y < head.starting_with("complete").y);
  CHECK(head.starting_with("complete").y < head.starting_with("plate 17").y);
  CHECK(head.starting_with("plate 17").y < head.starting_with("Shape").y);
  CHECK(svg.find("plate 17; cell loft; remark: a &lt; b<") != std::string::npos);
  in.about = "plate ";
  for (int i = 0; i < 200; ++i) in.about += "\xC3\x9F";  // two bytes a letter
  const std::string cut = overview_svg(in);
  check_order(Paper{cut});
  std::size_t letters = 0;
  for (auto at = cut.find("\xC3\x9F"); at != cut.npos; at = cut.find("\xC3\x9F", at + 1)) ++letters;
  CHECK(letters == 200);
  CHECK(cut.find("\xC3<") == std::string::npos);  // no letter is cut in two
}
