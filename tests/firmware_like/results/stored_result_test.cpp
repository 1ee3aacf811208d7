#include "firmware_like/results/stored_result.hpp"

#include "firmware_like/process/whole_file.hpp"
#include "firmware_like/report/findings_text.hpp"
#include "firmware_like/report/result_table.hpp"
#include "firmware_like/results/cad_files.hpp"
#include "firmware_like/results/summary.hpp"
#include "firmware_like/run/surface_file.hpp"
#include "hal/temporary_folder.hpp"

#include <doctest/doctest.h>

using namespace moldloft;
using namespace moldloft::firmware_like;

namespace {

// Every member differs from what it is by default, so that none can be forgotten on the way.
RunResult a_result() {
  RunResult r;
  r.label = {.plate = "17", .seed = 9, .begun = "2026-01-31T12:00:00Z", .remark = "cold"};
  r.cell = "loft";
  r.program = {"1.2.3", "0123456789ab", "Debug"};
  r.outcome = Outcome::complete;
  r.message = "as asked";
  r.shots = {.seek = 2, .boundary = 14, .surface = 16, .retaken = 1};
  r.points_seen = 1600000;
  r.edge_points = 3;
  auto& plate = r.measured.emplace();
  plate.outline.corners = {Eigen::Vector2d{0, 0}, {4, 0}, {4, 3}, {0, 3}};
  for (std::size_t i = 0; i < 4; ++i) {
    auto& side = plate.outline.sides[i];
    side.knots = geometry::uniform_clamped_knots(1);
    for (int k = 0; k < 4; ++k) {
      const double t = k / 3.0;
      side.control.push_back((1 - t) * plate.outline.corners[i] + t * plate.outline.corners[(i + 1) % 4]);
    }
  }
  plate.outline.rms_mm = 0.03;
  plate.outline.max_mm = 0.1234567890123;
  plate.surface.knots_u = plate.surface.knots_v = geometry::uniform_clamped_knots(1);
  for (auto* net : {&plate.surface.x, &plate.surface.y, &plate.surface.z}) {
    net->resize(4, 4);
    for (int i = 0; i < 4; ++i)
      for (int k = 0; k < 4; ++k) (*net)(i, k) = i + k / 7.0;
  }
  plate.fit.points_used = 794087;
  plate.fit.rms_residual_mm = 0.04;
  plate.fit.sigma_mm = 0.0509;
  plate.fit.smallest_pivot = 1e-3;
  plate.fit.empty_cells = 4;
  plate.fit.finest_spans_u = 64, plate.fit.finest_spans_v = 16;
  plate.fit.shot_offset_rms_mm = 0.0147;
  plate.fit.shot_offset_max_mm = 0.03;
  plate.tolerance_mm = 0.005;
  plate.ready_after_last_frame = std::chrono::milliseconds{24};
  r.track = {.edge_points = {{1.0 / 3, 2}, {3, 4}, {5, 6}},
             .corners = {{7, 8}},
             .boundary_places = {{{1, 2, 3}, 0.25}},
             .surface_places = {{{4, 5, 6}, 0.5}, {{7, 8, 9}, 0.75}},
             .field_x_mm = 80,
             .field_y_mm = 90};
  r.cycle = {.seconds = 17.5, .idle_fraction = 0.25, .standing_fraction = 0.125};
  r.memory = {{"recorder rings", 100, 50}, {"surface fit", 200, 200}};
  r.recorder_lost = 6;
  r.is_audited = true;
  r.findings = {{.kind = FindingKind::unseen,
                 .gravity = Gravity::warning,
                 .place = Eigen::Vector2d{1.5, 2.25},
                 .size_mm = 16,
                 .text = "no points there"},
                {.kind = FindingKind::noise,
                 .gravity = Gravity::warning,
                 .place = {},
                 .size_mm = 0.25,
                 .text = "too much"}};
  r.timing = {{"schema", 1}, {"ticks", 17500}};
  r.truth = {
      {"normal_rms_mm", 0.001}, {"normal_max_mm", 0.002}, {"outline_max_mm", 0.03}, {"corner_max_mm", 0.04}};
  r.fitted_from = "out/run-1";
  return r;
}

void leave(const RunResult& r, const std::filesystem::path& folder) {
  REQUIRE(write_file(folder / "summary.json", json_text(summary_json(r))).has_value());
  REQUIRE(write_file(folder / "track.json", json_text(track_json(r))).has_value());
  REQUIRE(write_file(folder / "timing.json", json_text(r.timing)).has_value());
  if (r.measured)
    REQUIRE(write_file(folder / "surface.json", json_text(surface_json(r.measured->surface))).has_value());
}

}  // namespace

TEST_CASE("a result that is read from its folder makes the same summary, table, track and CAD files") {
  const hal::TemporaryFolder folder;
  const RunResult taken = a_result();
  leave(taken, folder.path());
  const auto read = read_result(folder.path());
  REQUIRE(read.has_value());
  CHECK(summary_json(*read) == summary_json(taken));
  CHECK(track_json(*read) == track_json(taken));
  CHECK(read->timing == taken.timing);
  CHECK(about_run(*read) == about_run(taken));
  CHECK(result_table(*read, "here") == result_table(taken, "here"));
  CHECK(findings_section(*read) == findings_section(taken));
  CHECK(step_file(read->measured->surface, cad_facts(*read), "s.step").value() ==
        step_file(taken.measured->surface, cad_facts(taken), "s.step").value());
  CHECK(read->measured->outline.sides[2].value(0.5) == taken.measured->outline.sides[2].value(0.5));
}

TEST_CASE("a run that did not complete has no plate in its folder either") {
  const hal::TemporaryFolder folder;
  RunResult held = a_result();
  held.outcome = Outcome::held;
  held.measured.reset();
  leave(held, folder.path());
  const auto read = read_result(folder.path());
  REQUIRE(read.has_value());
  CHECK_FALSE(read->measured.has_value());
  CHECK(read->outcome == Outcome::held);
  CHECK(track_json(*read) == track_json(held));
}

TEST_CASE("a summary of another version is refused with its path") {
  const hal::TemporaryFolder folder;
  leave(a_result(), folder.path());
  for (const char* text :
       {"{}", "[]", R"({"schema":2,"result":"complete"})", R"({"schema":1,"result":"fine"})"}) {
    CAPTURE(text);
    REQUIRE(write_file(folder.path() / "summary.json", text).has_value());
    const auto read = read_result(folder.path());
    REQUIRE_FALSE(read.has_value());
    CHECK(read.error().what.starts_with((folder.path() / "summary.json").string() + ": "));
  }
}
