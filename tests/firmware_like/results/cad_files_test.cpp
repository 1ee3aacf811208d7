#include "firmware_like/results/cad_files.hpp"

#include "firmware_like/commands/export_command.hpp"
#include "firmware_like/process/complaint.hpp"
#include "firmware_like/results/summary.hpp"
#include "firmware_like/run/surface_file.hpp"
#include "hal/file_text.hpp"
#include "hal/temporary_folder.hpp"

#include <doctest/doctest.h>

#include <fstream>
#include <limits>
#include <unistd.h>

using namespace moldloft;
using namespace moldloft::firmware_like;
using hal::text_of;
namespace fs = std::filesystem;

namespace {

geometry::BSplineSurface small_surface() {
  geometry::BSplineSurface s;
  s.knots_u = geometry::uniform_clamped_knots(2);
  s.knots_v = geometry::uniform_clamped_knots(1);
  for (auto* net : {&s.x, &s.y, &s.z}) net->resize(5, 4);
  for (int i = 0; i < 5; ++i) {
    for (int k = 0; k < 4; ++k) {
      s.x(i, k) = 100 * geometry::greville(s.knots_u, i);
      s.y(i, k) = 50 * geometry::greville(s.knots_v, k);
      s.z(i, k) = 0.1 * i + k / 3.0;
    }
  }
  return s;
}

const Json summary = {{"plate", "saddle"},
                      {"begun", "2026-11-25T07:08:09Z"},
                      {"surface", {{"sigma_mm", 0.0509}, {"tolerance_mm", 0.005}}}};

// A run's folder as far as its surface goes.
void leave_results(const fs::path& folder, const geometry::BSplineSurface& surface) {
  fs::create_directories(folder);
  std::ofstream(folder / "surface.json") << surface_json(surface).dump() << "\n";
  std::ofstream(folder / "summary.json") << summary.dump(2) << "\n";
}

// What the command prints on stderr when it fails.
std::string refused(const ExportOptions& options) {
  const hal::TemporaryFolder folder;
  std::fflush(stderr);
  const int before = ::dup(2);
  REQUIRE(std::freopen(folder.file("stderr").c_str(), "w", stderr) != nullptr);
  const int code = export_run(options);
  std::fflush(stderr);
  ::dup2(before, 2);
  ::close(before);
  CHECK(code == exit_failed);
  return text_of(folder.file("stderr"));
}

}  // namespace

TEST_CASE("CAD files say the plate, the unit, the noise, the tolerance and when the run began") {
  const CadFacts facts = cad_facts(named_in(summary));
  const std::string step = step_file(small_surface(), facts, "surface.step").value();
  CHECK(step.find("PRODUCT('saddle','saddle',") != step.npos);
  CHECK(
      step.find(
          "'measured plate surface, mm, world coordinates; noise of a point 0.0509 mm; tolerance of the fit "
          "0.005 mm'") != step.npos);
  CHECK(step.find("FILE_NAME('surface.step','2026-11-25T07:08:09Z',") != step.npos);
  const std::string iges = iges_file(small_surface(), facts, "surface.igs").value();
  CHECK(iges.starts_with("saddle: measured plate surface, mm, world coordinates; noise of a point "));
  CHECK(iges.find("6Hsaddle,11Hsurface.igs,") != iges.npos);
  CHECK(iges.find("15H20261125.070809,") != iges.npos);
}

TEST_CASE("CAD files say cell, remark and the program that measured, each in its place") {
  Json told = summary;
  told["cell"] = "loft";
  told["remark"] = "it's cold";
  told["program"] = {{"version", "1.2.3"}, {"commit", "0123456789ab"}, {"build", "Debug"}};
  const CadFacts facts = cad_facts(named_in(told));
  const std::string step = step_file(small_surface(), facts, "s.step").value();
  CHECK(step.find("'cell: loft'") != step.npos);
  CHECK(step.find("'remark: it''s cold'") != step.npos);
  CHECK(step.find("'Moldloft 1.2.3 (commit 0123456789ab; Debug)'") != step.npos);
  const std::string iges = iges_file(small_surface(), facts, "s.igs").value();
  CHECK(iges.find("\ncell: loft ") != iges.npos);
  CHECK(iges.find("\nremark: it's cold ") != iges.npos);
  CHECK(iges.find("Moldloft 1.2.3 (commit") != iges.npos);
}

TEST_CASE("what a summary does not say is left out, and a time that is none is the fixed one") {
  const CadFacts facts = cad_facts(named_in(Json{{"plate", 7},
                                                 {"begun", "yesterday"},
                                                 {"surface", "none"},
                                                 {"program", {{"version", 3}}},
                                                 {"remark", nullptr}}));
  CHECK(facts.plate == "measured");
  const std::string step = step_file(small_surface(), facts, "s.step").value();
  CHECK(step.find("'1970-01-01T00:00:00Z'") != step.npos);
  CHECK(step.find("FILE_DESCRIPTION(('measured plate surface, mm, world coordinates'),") != step.npos);
  CHECK(cad_facts(named_in(Json::array())).plate == "measured");
}

TEST_CASE("a surface that is none is refused with the file's name and the reason") {
  auto surface = small_surface();
  surface.z(1, 1) = std::numeric_limits<double>::quiet_NaN();
  CHECK(step_file(surface, {}, "surface.step").error().what == "surface.step: a number is NaN or infinite");
}

TEST_CASE("a surface is read back from its file without losing a bit") {
  const hal::TemporaryFolder folder;
  const auto surface = small_surface();
  std::ofstream(folder.file("surface.json")) << surface_json(surface).dump();
  const auto read = read_surface(folder.file("surface.json"));
  REQUIRE(read.has_value());
  CHECK(read->knots_u == surface.knots_u);
  CHECK(read->knots_v == surface.knots_v);
  CHECK(read->x == surface.x);
  CHECK(read->y == surface.y);
  CHECK(read->z == surface.z);
}

TEST_CASE(
    "export writes the bytes that the run's own files have, from its folder and from its surface alone") {
  const hal::TemporaryFolder folder;
  const fs::path run = folder.path() / "run";
  leave_results(run, small_surface());
  const CadFacts facts = cad_facts(named_in(summary));
  const std::string step = folder.file("plate.step"), iges = folder.file("plate.igs");
  CHECK(export_run({.run = run, .step = step, .iges = iges}) == exit_done);
  CHECK(text_of(step) == step_file(small_surface(), facts, "plate.step").value());
  CHECK(text_of(iges) == iges_file(small_surface(), facts, "plate.igs").value());

  fs::rename(run / "surface.json", folder.file("alone.json"));
  const std::string before = text_of(step);
  CHECK(export_run({.run = folder.file("alone.json"), .step = step, .iges = {}}) == exit_failed);
  CHECK(text_of(step) == before);  // it says something else
  CHECK(export_run({.run = folder.file("alone.json"), .step = step, .iges = {}, .force = true}) == exit_done);
  CHECK(text_of(step) == step_file(small_surface(), {}, "plate.step").value());
}

TEST_CASE("export refuses with one line that says what, where and what to do") {
  const hal::TemporaryFolder folder;
  const fs::path run = folder.path() / "run";
  leave_results(run, small_surface());
  const std::string out = folder.file("out.step"), none = folder.file("none");
  CHECK(refused({.run = run, .step = {}, .iges = {}}) ==
        "moldloft: export: say where to with --step FILE, --iges FILE or both\n");
  CHECK(refused({.run = none, .step = out, .iges = {}}) == "moldloft: " + none + ": no such run or file\n");
  CHECK(refused({.run = folder.path(), .step = out, .iges = {}}) ==
        "moldloft: " + folder.path().string() +
            ": holds no surface.json; only a run that completed has a surface\n");
  const std::string nowhere = folder.file("no/such/folder.step");
  CHECK(refused({.run = run, .step = nowhere, .iges = {}}) ==
        "moldloft: " + nowhere + ": cannot be written: there is no folder " + folder.file("no/such") +
            "; make it first\n");
  std::ofstream(run / "summary.json") << "{";
  CHECK(refused({.run = run, .step = out, .iges = {}}) ==
        "moldloft: " + (run / "summary.json").string() + ": not JSON\n");
  auto json = surface_json(small_surface());
  json["knots_u"][4] = 7;
  std::ofstream(folder.file("bad.json")) << json;
  CHECK(refused({.run = folder.file("bad.json"), .step = out, .iges = {}}) ==
        "moldloft: " + folder.file("bad.json") + ": cannot be exported as out.step: knots decrease\n");
  json["unit"] = "inch";
  std::ofstream(folder.file("bad.json")) << json;
  CHECK(refused({.run = folder.file("bad.json"), .step = out, .iges = {}}) ==
        "moldloft: " + folder.file("bad.json") + ": schema 1 in mm is needed\n");
  CHECK_FALSE(fs::exists(out));
}
