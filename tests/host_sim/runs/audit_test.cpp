// Whole cells whose result is true, or says that it is not.
#include "firmware_like/commands/export_command.hpp"
#include "firmware_like/commands/fit_command.hpp"
#include "firmware_like/process/complaint.hpp"
#include "host_sim/scripted_run.hpp"

#include <doctest/doctest.h>

using namespace moldloft;
using namespace moldloft::host_sim;

namespace {

std::vector<std::string> kinds(const Json& summary) {
  std::vector<std::string> all;
  for (const auto& finding : summary["findings"]) all.push_back(finding["kind"]);
  return all;
}

}  // namespace

TEST_CASE("plates that swing farther than the boundary tells are seen whole") {
  struct Plate {
    const char* shape;
    ArmKind arm;
    double amplitude_mm;
    double width_mm, depth_mm;  // 0: as the cell has it
    std::uint64_t seed;
  };
  for (const auto& plate :
       {Plate{"wave", ArmKind::scara, 25, 0, 0, 4}, Plate{"wave", ArmKind::gantry, 32, 900, 600, 3},
        Plate{"saddle", ArmKind::scara, 30, 0, 0, 2}, Plate{"dome", ArmKind::scara, 32, 0, 0, 1},
        Plate{"wave", ArmKind::scara, 38, 0, 0, 1}}) {
    CAPTURE(plate.shape);
    CAPTURE(plate.seed);
    ScriptedRun cell;
    auto& description = cell.options.cell;
    description.plate = plate.shape;
    description.arm = plate.arm;
    description.amplitude_mm = plate.amplitude_mm;
    description.sizes.width_mm = plate.width_mm;
    description.sizes.depth_mm = plate.depth_mm;
    description.seed = plate.seed;
    const auto run = cell.run();
    // On steep plates errors in plan show in height, and the audit may say so.
    CHECK((run.exit_code == firmware_like::exit_done ||
           kinds(run.summary) == std::vector<std::string>{"shot_heights"}));
    CHECK(run.summary["truth"]["normal_max_mm"].get<double>() < 0.08);
  }
}

TEST_CASE("a plate that lies above the depth range is found a storey higher") {
  ScriptedRun cell;
  cell.options.cell.thickness_mm = 100;
  const auto run = cell.run();
  CHECK(run.exit_code == firmware_like::exit_done);
  check_truth(run.summary);
}

TEST_CASE("a scanner noisier than promised is measured with a warning, in the run and in every fit of it") {
  ScriptedRun cell;
  cell.set("noise_mm", "noise_mm = 0.02");
  const auto run = cell.run();
  CHECK(run.exit_code == firmware_like::exit_warned);
  CHECK(run.summary["result"] == "warned");
  CHECK(kinds(run.summary) == std::vector<std::string>{"noise"});
  CHECK(run.summary["findings"][0]["size_mm"].get<double>() == doctest::Approx(0.051).epsilon(0.1));
  CHECK(run.summary["message"] == "");
  CHECK(cell.file("report.html").find("Measured, with 1 warning.") != std::string::npos);
  const hal::TemporaryFolder other;
  CHECK(firmware_like::fit_run({.run = cell.folder(), .out = other.file("again"), .force = false}) ==
        firmware_like::exit_warned);
  CHECK(Json::parse(text_of(other.file("again") + "/summary.json"))["findings"] == run.summary["findings"]);
  CHECK(firmware_like::export_run({.run = cell.folder(), .step = other.file("p.step"), .iges = {}}) == 0);
}

TEST_CASE("a mount that is not the scanner's is held with the advice to look at it") {
  ScriptedRun cell;
  SUBCASE("turned by one degree") { cell.set("zyz_deg", "zyz_deg = [1, 180, 180]"); }
  SUBCASE("5 mm aside") { cell.set("translation_mm", "translation_mm = [5, 140, 300]"); }
  const auto run = cell.run();
  CAPTURE(run.summary["findings"].dump());
  CHECK(run.exit_code == firmware_like::exit_held);
  CHECK(run.summary["result"] == "held");
  CHECK(run.summary["message"].get<std::string>().find("check [scanner.mount]") != std::string::npos);
  // The surface is kept to look at; nobody bends a plate after it.
  CHECK(std::filesystem::exists(cell.folder() + "/surface.json"));
  CHECK_FALSE(std::filesystem::exists(cell.folder() + "/surface.step"));
  const hal::TemporaryFolder other;
  CHECK(firmware_like::export_run({.run = cell.folder(), .step = other.file("p.step"), .iges = {}}) ==
        firmware_like::exit_failed);
  CHECK_FALSE(std::filesystem::exists(other.file("p.step")));
  CHECK(firmware_like::export_run(
            {.run = cell.folder(), .step = other.file("p.step"), .iges = {}, .force = true}) == 0);
}
