// What a run says of the time that it still takes, held against the time that it then took.
#include "firmware_like/process/complaint.hpp"
#include "host_sim/scripted_run.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <vector>

using namespace moldloft;
using namespace moldloft::host_sim;
using namespace std::chrono_literals;

namespace {

struct Told {
  tasks::Phase phase{};
  double at_s = 0, left_s = 0;
  bool planned = false;
};

double seconds(hal::Duration d) { return std::chrono::duration<double>(d).count(); }

// All that was said in Execute, five times a second, and when the run was complete.
std::pair<std::vector<Told>, double> told_in(const CellDescription& cell) {
  std::vector<Told> told;
  double end_s = 0;
  ScriptedRun run;
  run.options.cell = cell;
  run.options.write_everything = false;
  run.options.on_progress = [&](const tasks::CellProgress& p) {
    end_s = seconds(p.now);
    if (p.state == tasks::CellState::execute)
      told.push_back({p.phase, seconds(p.now), seconds(p.time_left), p.left_is_planned});
  };
  REQUIRE(run.run().exit_code == firmware_like::exit_done);
  return {told, end_s};
}

}  // namespace

TEST_CASE("from the start of tracking on a run says how long it still takes, and says it better and better") {
  std::vector<CellDescription> cells(6);
  cells[1].plate = "wave";
  cells[1].seed = 2;
  cells[2].plate = "dome";
  cells[2].seed = 5;
  cells[2].outline = OutlineKind::parallelogram;
  cells[3].outline = OutlineKind::rectangle;
  cells[3].sizes = {.width_mm = 400, .depth_mm = 120};
  cells[4].plate = "flat";
  cells[4].outline = OutlineKind::trapezoid;
  cells[4].seed = 7;
  cells[5].sizes = {.width_mm = 150, .depth_mm = 150};
  cells[5].seed = 3;
  for (const auto& cell : cells) {
    CAPTURE(cell.plate);
    CAPTURE(cell.seed);
    const auto [told, end_s] = told_in(cell);
    double worst_tracking = 1, worst_planned = 0;
    int tracking = 0, unknown = 0;
    for (const auto& t : told) {
      const double truth = end_s - t.at_s;
      CAPTURE(t.at_s);
      CAPTURE(t.left_s);
      CAPTURE(truth);
      if (t.phase == tasks::Phase::track_boundary) {
        ++tracking;
        if (t.left_s < 0) ++unknown;
        CHECK_FALSE(t.planned);
        const double ratio = t.left_s / truth;
        worst_tracking = std::max({worst_tracking, ratio, 1 / ratio});
      }
      if (t.phase == tasks::Phase::scan_surface) {
        CHECK(t.planned);
        worst_planned = std::max(worst_planned, std::abs(t.left_s - truth) / end_s);
      }
    }
    CHECK(tracking > 10);
    CHECK(unknown == 0);
    CHECK(worst_tracking < 2);
    CHECK(worst_planned < 0.1);
  }
}

TEST_CASE(
    "a hold is noted with its reason, whom the cell waits for is published, and nobody guesses how long that "
    "takes") {
  ScriptedRun cell;
  hal::Instant cut{-1};
  bool mended = false;
  std::vector<tasks::Awaited> awaited;
  std::vector<tasks::Notice> notices;
  double left_while_held_s = 0;
  const auto run = cell.run([&](const SimulatedCell& c, hal::Instant now) {
    const auto& state = c.controller.cell();
    if (cut < 0s && state.shots_taken(hal::ShotPurpose::boundary) == 5) {
      cut = now;
      c.scanner_cable.cut();
    }
    if (cut >= 0s && !mended && now > cut + 2s) {
      mended = true;
      c.scanner_cable.mend();
    }
    const auto p = state.progress();
    if (awaited.empty() || awaited.back() != p.awaited) awaited.push_back(p.awaited);
    if (p.state == tasks::CellState::held) left_while_held_s = seconds(p.time_left);
    while (const auto notice = c.controller.cell().next_notice()) notices.push_back(*notice);
  });
  CHECK(run.exit_code == firmware_like::exit_done);
  using tasks::Awaited;
  CHECK(awaited.front() == Awaited::both);  // at the start neither has answered
  CHECK(std::ranges::find(awaited, Awaited::calibration) != awaited.end());
  CHECK(std::ranges::find(awaited, Awaited::scanner) != awaited.end());
  CHECK(awaited.back() == Awaited::nothing);
  CHECK(left_while_held_s < 0);  // nobody knows how long a hold takes
  REQUIRE(notices.size() == 2);
  CHECK(notices[0].kind == tasks::Notice::Kind::hold);
  CHECK(notices[0].text.view().find("scanner") != std::string_view::npos);
  CHECK(notices[1].kind == tasks::Notice::Kind::goes_on);
  CHECK(notices[1].text.view() == notices[0].text.view());
}
