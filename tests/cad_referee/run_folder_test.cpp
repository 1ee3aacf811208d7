// The CAD files that a run of the whole cell leaves, read by OpenCASCADE.
#include "cad_referee/occt_face.hpp"
#include "firmware_like/run/surface_file.hpp"
#include "geometry/cad/face_quadrature.hpp"
#include "hal/temporary_folder.hpp"
#include "host_sim/runs/simulated_run.hpp"

#include <doctest/doctest.h>

using namespace moldloft;

TEST_CASE("after a run, surface.step and surface.igs hold the surface of surface.json, bit for bit") {
  const hal::TemporaryFolder folder;
  host_sim::SimulatedRunOptions options;
  options.out = folder.file("run");
  const auto run = host_sim::simulate(options);
  REQUIRE_MESSAGE(run.has_value(), run.error().what);
  REQUIRE(run->exit_code == 0);
  const auto surface = firmware_like::read_surface(options.out / "surface.json");
  REQUIRE(surface.has_value());
  const geometry::TrimmedSurface face{.surface = *surface};
  const auto area = test::area_of(face), outline = test::outline_length_of(face);
  const auto step = referee::read_step(options.out / "surface.step");
  CHECK(step.name == run->summary["plate"].get<std::string>());
  for (const auto& read : {step, referee::read_iges(options.out / "surface.igs")}) {
    CHECK(read.faces == 1);
    CHECK(read.valid);
    CHECK(read.edges == 4);
    CHECK(read.surface.knots_u == surface->knots_u);
    CHECK(read.surface.knots_v == surface->knots_v);
    CHECK(read.surface.x == surface->x);
    CHECK(read.surface.y == surface->y);
    CHECK(read.surface.z == surface->z);
    CHECK(read.normal.z() > 0.9);  // towards the scanner
    CHECK(std::abs(read.area - area.value) <= area.error + read.area * read.area_error);
    CHECK(std::abs(read.outline - outline.value) <= outline.error + 1e-9 * outline.value);
  }
}
