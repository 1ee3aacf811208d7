#include "geometry/cad/iges_writer.hpp"

#include "geometry/cad/iges_file.hpp"
#include "geometry/cad/sample_faces.hpp"

#include <doctest/doctest.h>

#include <limits>
#include <set>

using namespace moldloft;
using geometry::CadLabel, geometry::Error, geometry::TrimmedSurface, geometry::iges_text;
using test::IgesFile;

namespace {

const CadLabel label{.name = "plate 7",
                     .description = "saddle, as measured; sigma 0.05 mm",
                     .file_name = "surface.igs",
                     .stamp = {2026, 11, 25, 7, 8, 9}};

std::vector<double> reals(const test::IgesEntity& e, std::size_t from, std::size_t n) {
  std::vector<double> all;
  for (std::size_t i = 0; i < n; ++i) all.push_back(e.real(from + i));
  return all;
}

}  // namespace

TEST_CASE(
    "every line of an IGES file has 80 columns, its section's letter and its number, and the end counts "
    "them") {
  CadLabel wordy = label;
  wordy.name = std::string(150, 'n');  // goes on over lines
  for (const auto& face : {TrimmedSurface{.surface = test::bent_plate()}, test::trimmed_plate()}) {
    const IgesFile file(iges_text(face, wordy).value());
    std::string order;
    std::map<char, int> count;
    for (const auto& line : file.lines) {
      REQUIRE(line.size() == 80);
      if (order.empty() || order.back() != line[72]) order += line[72];
      CHECK(std::stoi(line.substr(73)) == ++count[line[72]]);
    }
    CHECK(order == "SGDPT");
    const std::string end = file.sections.at('T').at(0);
    for (const auto& [letter, column] : {std::pair{'S', 0}, {'G', 8}, {'D', 16}, {'P', 24}}) {
      CHECK(end[column] == letter);
      CHECK(std::stoi(end.substr(column + 1, 7)) == count[letter]);
    }
    CHECK(file.global.size() == 26);
    CHECK(file.global[2] == "150H" + wordy.name);
  }
}

TEST_CASE("an IGES file says millimetres, its resolution, version 5.3, and the caller's time") {
  const IgesFile file(iges_text({.surface = test::bent_plate()}, label).value());
  const auto& g = file.global;
  REQUIRE(g.size() == 26);
  CHECK(g[0] == "1H,");
  CHECK(g[1] == "1H;");
  CHECK(g[2] == "7Hplate 7");
  CHECK(g[3] == "11Hsurface.igs");
  CHECK(g[12] == "1.");  // model space scale
  CHECK(g[13] == "2");   // millimetres
  CHECK(g[14] == "2HMM");
  CHECK(g[17] == "15H20261125.070809");
  CHECK(g[18] == "1.D-05");
  CHECK(g[22] == "11");
}

TEST_CASE(
    "directory and parameters of an IGES file point at each other, and no number is divided between lines") {
  const IgesFile file(iges_text(test::trimmed_plate(), label).value());
  const auto& data = file.sections.at('P');
  int next = 1;
  for (const auto& [number, e] : file.entities) {
    CHECK(e.first_line == next);  // one after the other, without gaps
    next += e.lines;
    CHECK(e.integer(0) == e.type);
    for (int l = 0; l < e.lines; ++l) {
      const std::string& line = data.at(e.first_line - 1 + l);
      CHECK(line[64] == ' ');
      CHECK(std::stoi(line.substr(65)) == number);
      const std::string text = line.substr(0, line.find_last_not_of(' ', 63) + 1);
      CHECK(text.ends_with(l + 1 < e.lines ? ',' : ';'));
    }
  }
  CHECK(next == static_cast<int>(data.size()) + 1);
}

TEST_CASE("an untrimmed face is entity 128 alone, with the surface's poles and knots, bit for bit") {
  for (const auto& s : {test::bent_plate(), test::uneven_plate()}) {
    const IgesFile file(iges_text({.surface = s}, label).value());
    REQUIRE(file.entities.size() == 1);
    const auto& e = file.entities.at(1);
    CHECK(e.type == 128);
    CHECK(e.status == "00000000");
    const std::size_t nu = s.control_u(), nv = s.control_v();
    CHECK(e.integer(1) == static_cast<int>(nu) - 1);
    CHECK(e.integer(2) == static_cast<int>(nv) - 1);
    CHECK(e.integer(3) == 3);
    CHECK(e.integer(4) == 3);
    CHECK(e.integer(7) == 1);  // polynomial
    std::size_t at = 10;
    CHECK(reals(e, at, nu + 4) == s.knots_u);
    at += nu + 4;
    CHECK(reals(e, at, nv + 4) == s.knots_v);
    at += nv + 4;
    CHECK(reals(e, at, nu * nv) == std::vector<double>(nu * nv, 1.0));
    at += nu * nv;
    for (int j = 0; j < s.control_v(); ++j) {
      for (int i = 0; i < s.control_u(); ++i, at += 3)
        CHECK(reals(e, at, 3) == std::vector<double>{s.x(i, j), s.y(i, j), s.z(i, j)});
    }
    CHECK(reals(e, at, 4) ==
          std::vector<double>{s.knots_u.front(), s.knots_u.back(), s.knots_v.front(), s.knots_v.back()});
    CHECK(e.parameters.size() == at + 4);
  }
}

TEST_CASE("a trimmed face is entity 144 over a 142 a loop, each a path in parameters and a curve in space") {
  const auto face = test::trimmed_plate();
  const IgesFile file(iges_text(face, label).value());
  const auto whole = file.all(144);
  REQUIRE(whole.size() == 1);
  const auto& f = *whole[0];
  CHECK(f.status == "00000000");
  CHECK(file.entities.at(f.integer(1)).type == 128);
  CHECK(file.entities.at(f.integer(1)).status == "00010000");
  CHECK(f.integer(2) == 1);  // the outer loop is not the border
  CHECK(f.integer(3) == 2);
  REQUIRE(f.parameters.size() == 7);
  const std::vector<const geometry::TrimLoop*> loops = {&face.outer, &face.holes[0], &face.holes[1]};
  for (std::size_t l = 0; l < 3; ++l) {
    const auto& on_surface = file.entities.at(f.integer(4 + l));
    CHECK(on_surface.type == 142);
    CHECK(on_surface.integer(2) == f.integer(1));
    CHECK(on_surface.integer(5) == 1);  // the path is what counts
    const auto curves = [&](std::size_t parameter) {
      const auto& e = file.entities.at(on_surface.integer(parameter));
      if (e.type == 126) return std::vector<const test::IgesEntity*>{&e};
      CHECK(e.type == 102);
      std::vector<const test::IgesEntity*> all;
      for (int i = 0; i < e.integer(1); ++i) all.push_back(&file.entities.at(e.integer(2 + i)));
      return all;
    };
    const auto paths = curves(3), images = curves(4);
    REQUIRE(paths.size() == loops[l]->size());
    REQUIRE(images.size() == loops[l]->size());
    for (std::size_t k = 0; k < paths.size(); ++k) {
      CHECK(paths[k]->status == "00010500");
      CHECK(images[k]->status == "00010000");
      // Walked backwards, a path is turned round: its first pole is the last.
      const auto& given = (*loops[l])[k];
      const auto& path = given.reversed ? geometry::reversed(given.path) : given.path;
      const std::size_t n = path.control.size();
      CHECK(paths[k]->integer(1) == static_cast<int>(n) - 1);
      CHECK(reals(*paths[k], 7, n + 4) == path.knots);
      for (std::size_t i = 0; i < n; ++i) {
        CHECK(reals(*paths[k], 7 + n + 4 + n + 3 * i, 3) ==
              std::vector<double>{path.control[i].x(), path.control[i].y(), 0});
      }
      // Where one ends the next begins, in space too.
      const auto ends = [](const test::IgesEntity& e) {
        const std::size_t m = e.integer(1) + 1, first = 7 + m + 4 + m;
        return std::pair{reals(e, first, 3), reals(e, first + 3 * (m - 1), 3)};
      };
      const auto here = ends(*images[k]).second, there = ends(*images[(k + 1) % images.size()]).first;
      for (int axis = 0; axis < 3; ++axis) CHECK(std::abs(here[axis] - there[axis]) <= label.closure_mm);
    }
  }
}

TEST_CASE("a whole face with a hole has the border for its outer loop") {
  auto face = test::trimmed_plate();
  face.outer.clear();
  const IgesFile file(iges_text(face, label).value());
  const auto& f = *file.all(144).at(0);
  CHECK(f.integer(2) == 0);
  CHECK(f.integer(3) == 2);
  CHECK(f.integer(4) == 0);
  CHECK(file.all(142).size() == 2);
}

TEST_CASE("an IGES writer refuses by name what is no face") {
  TrimmedSurface bad = test::trimmed_plate();
  bad.holes[0][0].path.control[2].x() = std::numeric_limits<double>::infinity();
  CHECK(iges_text(bad, label).error() == Error::not_finite);
}
