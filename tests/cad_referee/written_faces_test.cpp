// STEP and IGES files of ours, read by OpenCASCADE.
#include "cad_referee/occt_face.hpp"
#include "geometry/cad/face_edges.hpp"
#include "geometry/cad/face_quadrature.hpp"
#include "geometry/cad/iges_writer.hpp"
#include "geometry/cad/sample_faces.hpp"
#include "geometry/cad/step_writer.hpp"
#include "geometry/fit/plates_on_carriers.hpp"
#include "hal/temporary_folder.hpp"

#include <doctest/doctest.h>

#include <fstream>
#include <limits>

using namespace moldloft;
using referee::OcctFace;

namespace {

const geometry::CadLabel label{.name = "plate", .description = "a face for the referee", .file_name = "face"};

OcctFace through_step(const geometry::TrimmedSurface& face) {
  const hal::TemporaryFolder folder;
  std::ofstream(folder.file("face.step"), std::ios::binary) << geometry::step_text(face, label).value();
  return referee::read_step(folder.file("face.step"));
}
OcctFace through_iges(const geometry::TrimmedSurface& face) {
  const hal::TemporaryFolder folder;
  std::ofstream(folder.file("face.igs"), std::ios::binary) << geometry::iges_text(face, label).value();
  return referee::read_iges(folder.file("face.igs"));
}

// A space curve within e of its image, piece by piece with the ends in common, differs in slope by 3.1 e /
// h at most (the error of a Hermite piece is K s^2 (1-s)^2, at most K / 16; its slope at most 0.193 K /
// h): so in length by 3.1 e a piece. OpenCASCADE's own quadrature of the length is asked to be as good as
// 1e-9 of it.
double length_bound(const geometry::TrimmedSurface& face, double length) {
  double pieces = 0;
  const auto loops = geometry::face_edges(face, label.closure_mm).value();
  for (const auto& loop : loops) {
    if (loop.natural) continue;
    for (const auto& edge : loop.edges) pieces += static_cast<double>(edge.image.control.size()) / 2;
  }
  return 3.1 * label.closure_mm * pieces + 1e-9 * length;
}

void check_face(const OcctFace& read, const geometry::TrimmedSurface& face) {
  CHECK(read.faces == 1);
  CHECK(read.valid);
  CHECK(read.surface.knots_u == face.surface.knots_u);
  CHECK(read.surface.knots_v == face.surface.knots_v);
  CHECK(read.surface.x == face.surface.x);
  CHECK(read.surface.y == face.surface.y);
  CHECK(read.surface.z == face.surface.z);
  std::size_t edges = test::outer_loop(face).size();
  for (const auto& hole : face.holes) edges += hole.size();
  CHECK(read.edges == static_cast<int>(edges));
  CHECK(read.wires == static_cast<int>(1 + face.holes.size()));
  CHECK(read.normal.z() > 0.5);
  const auto area = test::area_of(face), length = test::outline_length_of(face);
  CAPTURE(area.error);
  CAPTURE(length.error);
  CAPTURE(read.area_error);
  // Trims are followed by OpenCASCADE along the path or the space curve: as far apart as the file
  // says, all round.
  const double trims = face.outer.empty() && face.holes.empty() ? 0 : label.closure_mm * length.value;
  CHECK(std::abs(read.area - area.value) <= area.error + read.area * read.area_error + trims);
  CHECK(std::abs(read.outline - length.value) <= length.error + length_bound(face, length.value));
}

}  // namespace

TEST_CASE(
    "an untrimmed face is one valid face with the same bits, area and outline, from STEP and from IGES") {
  for (const auto& surface : {test::bent_plate(), test::uneven_plate()}) {
    const geometry::TrimmedSurface face{.surface = surface};
    SUBCASE("STEP") { check_face(through_step(face), face); }
    SUBCASE("IGES") { check_face(through_iges(face), face); }
  }
}

TEST_CASE("a trimmed face with holes is one valid face with the same bits, area and outline") {
  const auto face = test::trimmed_plate();
  SUBCASE("STEP") { check_face(through_step(face), face); }
  SUBCASE("IGES") { check_face(through_iges(face), face); }
}

TEST_CASE("the face lies inside its outer loop and outside its holes, right side up") {
  const auto face = test::trimmed_plate();
  for (const OcctFace& read : {through_step(face), through_iges(face)}) {
    const auto plan = [&](double u, double v) { return face.surface.at(u, v).value; };
    const auto covers = [&](double u, double v) { return read.covers(plan(u, v).x(), plan(u, v).y()); };
    CHECK(covers(0.2, 0.25));
    CHECK(covers(0.75, 0.25));
    CHECK(covers(0.45, 0.5));
    CHECK(covers(0.44, 0.85));
    CHECK_FALSE(covers(0.05, 0.05));
    CHECK_FALSE(covers(0.9, 0.9));
    CHECK_FALSE(covers(0.1, 0.8));
    CHECK_FALSE(covers(0.45, 0.35));  // in the first hole
    CHECK_FALSE(covers(0.47, 0.61));  // in the second
  }
}

TEST_CASE("a face turned over shows its other side, and is as valid") {
  // v runs backwards: du x dv points down.
  geometry::TrimmedSurface face{.surface = test::bent_plate()};
  for (auto* net : {&face.surface.x, &face.surface.y, &face.surface.z})
    *net = net->rowwise().reverse().eval();
  for (const OcctFace& read : {through_step(face), through_iges(face)}) {
    CHECK(read.valid);
    CHECK(read.normal.z() < -0.5);
  }
}

TEST_CASE("a hole in the whole border, and an outer loop that meets the border, are read as they are meant") {
  geometry::TrimmedSurface holed = test::trimmed_plate();
  holed.outer.clear();
  // The lower half of the plate: three of its sides lie on the border itself.
  const auto line = [](const Eigen::Vector2d& a, const Eigen::Vector2d& b) { return test::bow(a, b, 0); };
  const geometry::TrimmedSurface half{.surface = test::bent_plate(),
                                      .outer = {{.path = line({0, 0}, {1, 0})},
                                                {.path = line({1, 0}, {1, 0.5})},
                                                {.path = test::bow({1, 0.5}, {0, 0.5}, 0.03)},
                                                {.path = line({0, 0.5}, {0, 0})}}};
  for (const auto& face : {holed, half}) {
    SUBCASE("STEP") { check_face(through_step(face), face); }
    SUBCASE("IGES") { check_face(through_iges(face), face); }
  }
}

TEST_CASE("hexagonal and round plates, fitted over a carrier and trimmed, keep their area and their shape") {
  for (const auto& plate : {test::hexagonal_plate(), test::round_plate()}) {
    CAPTURE(plate.name);
    const auto fitted = test::fitted_on_carrier(plate);
    for (const OcctFace& read : {through_step(fitted.face), through_iges(fitted.face)}) {
      check_face(read, fitted.face);
      const double trims = label.closure_mm * test::outline_length_of(fitted.face).value;
      CHECK(std::abs(read.area - plate.area_mm2) <=
            read.area * read.area_error + trims + fitted.area_bound(plate));
      // What was read, against the truth: every corner of its triangles lies on the surface, so off by no
      // more than the fit is anywhere inside the outline, and by half again where that was not looked at.
      for (const auto& p : read.points)
        CHECK(std::abs(p.z() - plate.height(p.x(), p.y())) <= 1.5 * fitted.max_mm);
    }
  }
}
