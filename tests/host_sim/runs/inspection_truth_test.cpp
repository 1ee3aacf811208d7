// Sixty plates with known mistakes, measured by the simulated cell and inspected: deviations, poses and verdicts
// against what the formulas say.
#include "firmware_like/inspection/inspection.hpp"
#include "hal/temporary_folder.hpp"
#include "host_sim/runs/simulated_run.hpp"

#include <doctest/doctest.h>
#include <fmt/format.h>

#include <array>
#include <cmath>

using namespace moldloft;
using namespace moldloft::host_sim;
using firmware_like::Inspection;

namespace {

struct Known {
  Shape shape;
  OutlineKind outline;
  const char* mistakes;
};

// Shapes x outlines x mistakes; a saddle, a twist and a flat plate on a square fit from several sides.
std::vector<Known> sixty() {
  std::vector<Known> all;
  constexpr std::array mistakes{"springback 0.85", "twist 4 mm", "dent 3 mm at 30,20 radius 70",
                                "bow 2 mm, twist -2 mm", "springback 1.1, dent -2 mm at -40,-30 radius 80"};
  for (const auto shape : {Shape::wave, Shape::dome, Shape::saddle}) {
    for (const auto outline :
         {OutlineKind::square, OutlineKind::rectangle, OutlineKind::trapezoid, OutlineKind::parallelogram}) {
      for (const char* m : mistakes) all.push_back({shape, outline, m});
    }
  }
  return all;
}

firmware_like::Design design_of(const CellDescription& cell) {
  firmware_like::Design design;
  design.faces.push_back({spline_of(*designed_plate(cell).value()), {}});
  return design;
}

}  // namespace

TEST_CASE(
    "sixty plates with known mistakes: every deviation, nearly every pose, and the verdicts are right") {
  const hal::TemporaryFolder folder;
  int poses_within = 0, measured = 0;
  double worst = 0;
  const auto plates = sixty();
  REQUIRE(plates.size() == 60);
  for (std::size_t n = 0; n < plates.size(); ++n) {
    const auto& known = plates[n];
    SimulatedRunOptions options;
    options.cell.plate = std::string{shape_names()[static_cast<std::size_t>(known.shape)]};
    options.cell.outline = known.outline;
    options.cell.has_design = true;
    options.cell.formed = mistakes_from(known.mistakes).value();
    options.cell.seed = n + 1;
    options.write_everything = false;
    options.out = folder.file(fmt::format("run-{}", n));
    CAPTURE(options.cell.plate);
    CAPTURE(std::string{known.mistakes});
    CAPTURE(n);
    const auto run = simulate(options);
    REQUIRE(run);
    REQUIRE(run->result.measured);
    ++measured;
    const auto design = design_of(options.cell);
    firmware_like::InspectionSettings settings;
    settings.limit = {-1.5, 1.5};
    const auto seen = firmware_like::inspect(run->result, {}, design, settings);
    REQUIRE_MESSAGE(seen.has_value(), seen.error().what);

    // The same question asked of the plate as it truly is, at the places that were measured.
    auto exact = run->result;
    const auto placed = placed_plate(options.cell).value();
    const auto truth = spline_of(*placed.plate, placed.world_from_plate());
    exact.measured->surface = truth;
    const auto known_best = firmware_like::inspect(exact, {}, design, settings);
    REQUIRE(known_best);
    const auto true_faces = geometry::DesignFaces::from(std::array{geometry::DesignFace{truth, {}}}).value();
    const auto design_faces = geometry::DesignFaces::from(design.faces).value();
    std::size_t off = 0;
    double most = 0;
    for (const auto& place : seen->places) {
      if (place.beyond) continue;
      // The true plate's deviation at this place: under the best fit of the true plate.
      const Eigen::Vector3d world = seen->design_from_world.inverse() * place.at;
      const auto on_plate = true_faces.foot(world);
      const auto foot = design_faces.foot(known_best->design_from_world * on_plate.point);
      if (foot.overhang_mm > 0.3 || on_plate.overhang_mm > 0.3) continue;
      const double error = std::abs(place.mm - foot.signed_mm);
      most = std::max(most, error - 2 * place.sigma_mm);
      off += error > 0.03 + 2 * place.sigma_mm ? 1 : 0;
    }
    worst = std::max(worst, most);
    CHECK_MESSAGE(off == 0, fmt::format("{} places, {:.3f} mm beyond two sigma", off, most));

    const geometry::RigidMotion apart = seen->design_from_world * known_best->design_from_world.inverse();
    const Eigen::AngleAxisd turn{apart.linear()};
    Eigen::Matrix<double, 6, 1> d;
    d << apart * seen->alignment.centroid - seen->alignment.centroid, turn.angle() * turn.axis();
    const Eigen::Matrix<double, 6, 6> covariance = seen->alignment.covariance;
    const double chi = d.dot(covariance.ldlt().solve(d));
    poses_within += chi < 12.59 ? 1 : 0;
    if (!seen->is_close && !known_best->is_close) CHECK(seen->verdict == known_best->verdict);
  }
  MESSAGE(fmt::format("{} plates, worst {:.3f} mm beyond two sigma, {} poses within", measured, worst,
                      poses_within));
  CHECK(poses_within >= measured * 95 / 100);
}

TEST_CASE(
    "the thesis's example: 1,169 points of a measuring machine on a plate of 305 mm, published at most 1.49 "
    "mm off") {
  const hal::TemporaryFolder folder;
  SimulatedRunOptions options;
  options.cell.plate = "saddle";
  options.cell.amplitude_mm = 20;
  options.cell.seed = 7;
  options.write_everything = false;
  options.out = folder.file("run");
  const auto run = simulate(options);
  REQUIRE(run);
  REQUIRE(run->result.measured);
  // The machine has touched the plate as it is, in a frame of its own: evenly (Halton's sequence), 5 mm from the edge.
  const auto plate = designed_plate(options.cell).value();
  const auto halton = [](int i, int base) {
    double value = 0, part = 1;
    for (; i > 0; i /= base) part /= base, value += part * (i % base);
    return value;
  };
  firmware_like::Design touched;
  touched.kind = firmware_like::DesignKind::points;
  touched.file = "cmm.xyz";
  for (int i = 1; i <= 1169; ++i) {
    const double x = (halton(i, 2) - 0.5) * 295, y = (halton(i, 3) - 0.5) * 295;
    touched.points.push_back({x + 2000, y - 70, plate->height(x, y) + 450});
  }
  const auto found = firmware_like::inspect(run->result, {}, touched, {});
  REQUIRE_MESSAGE(found.has_value(), found.error().what);
  const double most = std::max(std::abs(found->worst.front().mm), std::abs(found->inside.least_mm));
  MESSAGE(fmt::format("{} points, max {:.3f} mm, rms {:.4f} mm", found->places.size(), most,
                      found->inside.rms_mm));
  CHECK(found->inside.count + found->border.count == 1169);
  CHECK(most < 0.1);
  CHECK(found->inside.rms_mm < 0.02);
}
