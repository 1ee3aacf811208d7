// The whole cell under virtual time: controller, cables, devices, plate; nothing goes wrong here.
#include "firmware_like/commands/export_command.hpp"
#include "firmware_like/commands/fit_command.hpp"
#include "firmware_like/process/build_info.hpp"
#include "firmware_like/process/complaint.hpp"
#include "host_sim/runs/day.hpp"
#include "host_sim/scripted_run.hpp"

#include <doctest/doctest.h>

using namespace moldloft;
using namespace moldloft::host_sim;
using namespace std::chrono_literals;

TEST_CASE("the default run completes, and its summary says everything that it promises") {
  ScriptedRun cell;
  const auto run = cell.run();
  const Json& s = run.summary;
  CHECK(run.exit_code == firmware_like::exit_done);
  CHECK(s["schema"] == 1);
  CHECK(s["result"] == "complete");
  CHECK(s["plate"] == "saddle, seed 1");
  CHECK(s["cell"] == "simulated SCARA cell");
  CHECK(s["program"]["version"] == firmware_like::build_info().version);
  CHECK(s["program"]["commit"] == firmware_like::build_info().commit);
  CHECK_FALSE(s.contains("remark"));
  CHECK(s["seed"] == 1);
  CHECK(s["shots"]["boundary"].get<int>() >= 10);
  CHECK(s["shots"]["surface"].get<int>() ==
        16);  // 305 mm is four fields of 102 mm with 10 mm of overlap, each way
  CHECK(s["shots"]["retaken"] == 0);
  CHECK(s["points"]["total"].get<int>() == 50000 * static_cast<int>(cell.shots().size()));
  CHECK(s["points"]["used"].get<int>() > 500000);
  CHECK(s["points"]["used"].get<int>() < s["points"]["total"].get<int>());
  CHECK(s["boundary"]["corners_mm"].size() == 4);
  CHECK(s["surface"]["control_points"].size() == 2);
  CHECK(s["surface"]["rms_residual_mm"].get<double>() == doctest::Approx(0.051).epsilon(0.1));
  CHECK(s["surface"]["sigma_mm"].get<double>() ==
        doctest::Approx(0.051).epsilon(0.02));  // the scanner's own noise
  const double seconds = s["cycle"]["seconds"].get<double>();
  CHECK(seconds > 5);
  CHECK(seconds < 60);
  // What a frame decides leaves in the tick that reads its last byte: the frame was looked at while it came.
  const Json timing = Json::parse(cell.file("timing.json"));
  CHECK(timing["frame_to_command"]["count"] ==
        s["shots"]["seek"].get<int>() + s["shots"]["boundary"].get<int>() - 1);
  CHECK(timing["frame_to_command"]["max_us"] == 0);
  REQUIRE(timing["losses"].size() == 6);
  for (const auto& loss : timing["losses"]) CHECK_MESSAGE(loss["count"] == 0, loss.dump());
  // Of cell time: a step of the fit is charged its whole quantum, whatever the machine.
  CHECK(s["surface"]["ready_after_last_frame_ms"].get<double>() <= 50);
  CHECK(s["cycle"]["idle_fraction"].get<double>() >= 0);
  CHECK(s["cycle"]["idle_fraction"].get<double>() <= s["cycle"]["standing_fraction"].get<double>());
  CHECK(s["cycle"]["standing_fraction"].get<double>() < 1);
  CHECK(s["memory"]["plan_bytes"].get<std::size_t>() > (1u << 20));
  CHECK(s["memory"]["high_water_bytes"].get<std::size_t>() > 0);
  CHECK(s["memory"]["high_water_bytes"].get<std::size_t>() <= s["memory"]["plan_bytes"].get<std::size_t>());
  check_truth(s);
  CHECK(cell.states() == std::vector<std::string>{"Starting", "Execute", "Completing", "Complete"});
  CHECK(Json::parse(cell.file("summary.json")) == s);
  const hal::TemporaryFolder cad;
  CHECK(firmware_like::export_run({.run = cell.folder(), .step = cad.file("surface.step"), .iges = {}}) == 0);
  CHECK(text_of(cad.file("surface.step")) == cell.file("surface.step"));
  for (const char* file : {"boundary.ply", "points.ply", "surface.json", "surface.step", "surface.igs",
                           "timing.json", "report.html", "overview.svg", "events.jsonl"}) {
    CAPTURE(file);
    CHECK(cell.file(file).size() > 100);
  }
}

TEST_CASE("the same seed gives the same bytes, another seed others") {
  ScriptedRun first, second, other;
  other.options.cell.seed = 2;
  first.run();
  second.run();
  other.run();
  for (const char* file : {"summary.json", "surface.json", "surface.step", "surface.igs", "events.jsonl"}) {
    CAPTURE(file);
    CHECK(first.file(file).size() > 1000);
    CHECK(first.file(file) == second.file(file));
    CHECK(first.file(file) != other.file(file));
  }
}

TEST_CASE("every shape with every outline is measured within the limits") {
  const auto campaign =
      run_program({MOLDLOFT_SIM, "campaign", "--plates", "all", "--seeds", "1", "--json"}, 200s);
  REQUIRE_MESSAGE(campaign.exit_code == 0, campaign.out);
  const auto rows = Json::parse(campaign.out);
  CHECK(rows.size() == 24);
  std::set<std::string> kinds;
  for (const auto& row : rows) {
    kinds.insert(row["plate"].get<std::string>() + row["outline"].get<std::string>());
    CHECK(row["seed"] == 1);
    CHECK(row["result"] == "complete");
    check_truth(row);
  }
  CHECK(kinds.size() == 24);
}

TEST_CASE("the gantry measures a plate that no SCARA reaches") {
  ScriptedRun cell;
  cell.options.cell.arm = ArmKind::gantry;
  cell.options.cell.sizes.width_mm = 700;
  const auto run = cell.run();
  CHECK(run.summary["result"] == "complete");
  check_truth(run.summary);
}

TEST_CASE("a finished run fitted once more gives the same surface to the last bit") {
  ScriptedRun cell;
  cell.run();
  const hal::TemporaryFolder results;
  CHECK(firmware_like::fit_run({.run = cell.folder(), .out = results.path()}) == firmware_like::exit_done);
  CHECK(text_of(results.file("surface.json")) == cell.file("surface.json"));
}

TEST_CASE("a run whose power was cut goes on after its last stored shot, in every phase") {
  for (const auto cut : {3s, 6s, 12s}) {  // seeking or calibrating, on the boundary, on the surface
    CAPTURE(cut.count());
    ScriptedRun cell;
    cell.options.time_limit = cut;
    const auto before = cell.run();
    CHECK(before.summary["result"] == "stopped");
    const auto stored = cell.shots().size();
    cell.options.time_limit = 1h;
    cell.options.resume = true;
    const auto after = cell.run();
    CHECK(after.exit_code == firmware_like::exit_done);
    check_truth(after.summary);
    CHECK(cell.exposures == cell.shots().size() - stored);  // what was stored is not taken again
    for (const auto& shot :
         cell.shots()) {  // and no id of before is asked for once more: the scanner may still hold its frame
      const bool is_new = tasks::shot_number_of(shot.shot_id) > stored;
      const std::uint32_t epoch = is_new && stored > 0 ? 2 : 1;
      CHECK((shot.shot_id >> tasks::shot_number_bits) == epoch);
    }
    const hal::TemporaryFolder results;
    CHECK(firmware_like::fit_run({.run = cell.folder(), .out = results.path()}) == firmware_like::exit_done);
    CHECK(text_of(results.file("surface.json")) == cell.file("surface.json"));
  }
}

TEST_CASE("a finished run that is resumed is fitted again, and the arm goes nowhere") {
  ScriptedRun cell;
  cell.run();
  const std::string surface = cell.file("surface.json");
  cell.options.resume = true;
  const auto again = cell.run();
  CHECK(again.summary["result"] == "complete");
  CHECK(cell.motions == 0);
  CHECK(cell.exposures == 0);
  CHECK(cell.file("surface.json") == surface);
}

TEST_CASE(
    "plate after plate under one controller: memory and handles stay, nothing is lost, ticks keep their "
    "beat") {
  DayOptions options;
  options.hours = 4 * 25.0 / 3600;
  options.every_s = 25;
  options.rows = 4;
  const auto day = run_day(options);
  REQUIRE_MESSAGE(day.has_value(), day.error().what);
  REQUIRE(day->rows.size() == 4);
  for (std::size_t i = 0; i < day->rows.size(); ++i) {
    const DayRow& row = day->rows[i];
    CHECK(row.plates == i + 1);
    CHECK(row.off_beat_ns == 0);
    CHECK(row.missed == 0);
    CHECK(row.recorder_lost == 0);
    CHECK(row.handles == day->rows[0].handles);
    CHECK(row.threads == 1);
    CHECK(row.worst_normal_mm <= 0.08);
  }
  CHECK(day->rows.back().ticks == 4 * 25 * 1000 + 1);  // the first tick is due at 0
  CHECK(day->rows.back().shots == 4 * day->rows.front().shots);
  CHECK(day->flat);
}
