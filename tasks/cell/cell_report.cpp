#include "tasks/cell/cell_report.hpp"

namespace moldloft::tasks {

using hal::ShotPurpose;

Awaited awaited(const Waiting& w) {
  const Awaited device = w.scanner_missing && w.robot_missing ? Awaited::both
                         : w.scanner_missing                  ? Awaited::scanner
                         : w.robot_missing                    ? Awaited::robot
                                                              : Awaited::nothing;
  switch (w.state) {
    case CellState::starting:
      return w.calibrates ? Awaited::calibration : device;
    case CellState::holding:
    case CellState::stopping:
    case CellState::aborting:
      return Awaited::arm_at_rest;
    case CellState::held:
      return w.cause == HoldCause::scanner    ? Awaited::scanner
             : w.cause == HoldCause::recorder ? Awaited::disk
             : w.cause == HoldCause::person   ? Awaited::word_unhold
                                              : Awaited::nothing;  // it would only come to the same again
    case CellState::unholding:
      return device;
    case CellState::aborted:
      return w.cause < HoldCause::plan ? Awaited::word_clear : Awaited::nothing;
    case CellState::clearing:
      return w.robot_missing ? Awaited::robot : Awaited::nothing;
    default:
      return Awaited::nothing;
  }
}

void CellReport::publish() {
  const auto& [supervisor, start, shots, measurement, scanner, arm, devices] = parts_;
  CellProgress p{.state = supervisor.state(),
                 .phase = measurement.phase(),
                 .cause = supervisor.cause(),
                 .now = supervisor.now(),
                 .why = supervisor.why()};
  p.boundary_shots =
      measurement.shots_taken(ShotPurpose::seek) + measurement.shots_taken(ShotPurpose::boundary);
  p.surface_shots = measurement.shots_taken(ShotPurpose::surface);
  p.surface_planned = static_cast<int>(measurement.surface_places().size());
  p.retaken = shots.retaken();
  p.part_done = measurement.part_done();
  if (p.state == CellState::execute) {
    const auto left = measurement.left();
    p.time_left = left.time;
    p.left_is_planned = left.is_planned;
  }
  p.awaited = awaited({.state = p.state,
                       .cause = p.cause,
                       .calibrates = start.calibrates(),
                       .scanner_missing = devices && !start.scanner_ready(),
                       .robot_missing = devices && arm.robot().state() != hal::RobotState::ready});
  if (p.awaited == Awaited::scanner || p.awaited == Awaited::both) p.awaited_why.assign(scanner.why());
  if (p.awaited == Awaited::robot) p.awaited_why.assign(arm.robot().why());
  if (p.awaited == Awaited::both) p.robot_why.assign(arm.robot().why());
  published_.set(p);
}

}  // namespace moldloft::tasks
