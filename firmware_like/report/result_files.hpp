// What a run leaves in its folder besides run.db: summary.json, boundary.ply, points.ply, surface.json, surface.step,
// surface.igs, track.json, timing.json, report.html, events.jsonl and overview.svg. Written after the cell has
// come to rest; every file states its unit.
//
// summary.json, surface.*, track.json and events.jsonl depend on the run alone, never on the machine: a simulated run
// with the same seed gives the same bytes. What was measured in wall-clock time stands in timing.json.
//
// Blocking     yes: writes files
// Failure      one line naming the first file that could not be written; all others are
#pragma once

#include "firmware_like/results/plate_field.hpp"
#include "firmware_like/results/run_result.hpp"
#include "firmware_like/run/run_folder.hpp"

#include <expected>
#include <optional>

namespace moldloft::firmware_like {

// Everything that can be written for the state that the run is in: a run that did not complete has no
// surface. `error_field`, when given, is what the picture's second panel shows instead of the fit's residuals.
std::expected<void, Failure> write_results(const RunResult&, const RunFolder&,
                                           const std::optional<PlateField>& error_field = {});

}  // namespace moldloft::firmware_like
