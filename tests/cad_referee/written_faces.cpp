// STEP and IGES files of ours, read by OpenCASCADE.
#include <doctest/doctest.h>

#include <fstream>
#include <limits>

#include "cad_referee/occt_face.hpp"
#include "geometry/cad/face_edges.hpp"
#include "geometry/cad/face_quadrature.hpp"
#include "geometry/cad/iges_writer.hpp"
#include "geometry/cad/sample_faces.hpp"
#include "geometry/cad/step_writer.hpp"
#include "hal/temporary_folder.hpp"

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

// A space curve within e of its image, piece by piece with the ends in common, differs in slope by 3.1 e / h at most
// (the error of a Hermite piece is K s^2 (1-s)^2, at most K / 16; its slope at most 0.193 K / h): so in length by 3.1 e
// a piece. OpenCASCADE's own quadrature of the length is asked to be as good as 1e-9 of it.
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
  MESSAGE("area " << read.area - area.value << " length " << read.outline - length.value << " errs "
                  << area.error << " " << length.error << " " << read.area_error << " tol " << read.tolerance
                  << " lb " << length_bound(face, length.value));
  CHECK(std::abs(read.area - area.value) <=
        area.error + read.area * read.area_error + label.closure_mm * length.value);
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
