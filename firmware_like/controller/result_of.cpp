#include "firmware_like/controller/result_of.hpp"

#include "firmware_like/config/cell_settings.hpp"
#include "firmware_like/process/build_info.hpp"
#include "firmware_like/results/audit.hpp"
#include "firmware_like/results/timing_report.hpp"

#include <algorithm>

namespace moldloft::firmware_like {
namespace {

double seconds(hal::Duration d) { return std::chrono::duration<double>(d).count(); }

template <typename Range>
auto copied(const Range& range) {
  return std::vector(std::begin(range), std::end(range));
}

std::optional<MeasuredPlate> measured_by(const Controller& c) {
  if (c.cell().state() != tasks::CellState::complete) return std::nullopt;
  return MeasuredPlate{.outline = c.surface().outline(),
                       .surface = c.surface().fit().surface(),
                       .fit = c.surface().fit().report(),
                       .tolerance_mm = c.config().fit_tolerance_mm,
                       .ready_after_last_frame = c.cell().surface_after_last_frame()};
}

RunTrack track_of(const Controller& c) {
  return {.edge_points = copied(c.cell().tracker().edge_points()),
          .corners = copied(c.cell().tracker().corners()),
          .boundary_places = copied(c.cell().boundary_places()),
          .surface_places = copied(c.cell().surface_places()),
          .field_x_mm = c.config().scanner.field_x_mm,
          .field_y_mm = c.config().scanner.field_y_mm};
}

CycleShares shares_of(const tasks::CycleTimes& cycle) {
  const double total = std::max(seconds(cycle.total), 1e-9);
  return {.seconds = seconds(cycle.total),
          .idle_fraction = seconds(cycle.idle) / total,
          .standing_fraction = seconds(cycle.standing) / total};
}

std::vector<NamedLosses> losses_of(const Controller& c) {
  return {{"scanner", c.scanner().losses()}, {"robot", c.robot().losses()}};
}

}  // namespace

Outcome outcome_of(const Controller& c) {
  switch (c.cell().state()) {
    case tasks::CellState::complete:
      return Outcome::complete;
    case tasks::CellState::held:
      return Outcome::held;
    case tasks::CellState::aborted:
      return Outcome::aborted;
    default:
      return Outcome::stopped;
  }
}

RunResult result_of(const Controller& c, const RunLabel& label, const RunConditions* conditions) {
  const auto& cell = c.cell();
  const BuildInfo& build = build_info();
  RunResult r;
  r.label = label;
  r.cell = c.config().name;
  r.program = {std::string{build.version}, std::string{build.commit}, std::string{build.build}};
  r.outcome = outcome_of(c);
  r.message = std::string{cell.why().view()};
  r.shots = {.seek = cell.shots_taken(hal::ShotPurpose::seek),
             .boundary = cell.shots_taken(hal::ShotPurpose::boundary),
             .surface = cell.shots_taken(hal::ShotPurpose::surface),
             .retaken = cell.shots_retaken()};
  r.points_seen = cell.points_seen();
  r.edge_points = cell.tracker().edge_points().size();
  r.measured = measured_by(c);
  r.track = track_of(c);
  r.tip_from_scanner = c.config().scanner.tip_from_scanner;
  r.promised = promise_of(c.config());
  r.evidence = cell.evidence();
  r.cycle = shares_of(cell.cycle());
  r.memory = c.memory();
  r.recorder_lost = c.recorder().lost();
  r.timing = timing_report({.scheduler = c.scheduler(),
                            .cell = &cell,
                            .conditions = conditions,
                            .losses = losses_of(c),
                            .dumps_too_soon = c.flight().later_triggers()});
  take_audit(r);
  return r;
}

}  // namespace moldloft::firmware_like
