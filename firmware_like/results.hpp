// What a run leaves in its folder besides run.db: summary.json, boundary.ply, points.ply, surface.json,
// surface.step, surface.igs, timing.json, report.html, events.jsonl and overview.svg. Written after the cell has
// come to rest; every file states its unit.
//
// summary.json, surface.* and events.jsonl depend on the run alone, never on the machine: a simulated run
// with the same seed gives the same bytes. What was measured in wall-clock time stands in timing.json.
//
// Blocking     yes: writes files
// Failure      one line naming the first file that could not be written; all others are
#pragma once

#include "firmware_like/controller.hpp"
#include "firmware_like/environment_report.hpp"
#include "firmware_like/picture.hpp"
#include "firmware_like/run_folder.hpp"
#include "firmware_like/surface_file.hpp"
#include "firmware_like/whole_file.hpp"

#include <cstdint>
#include <expected>
#include <filesystem>
#include <optional>
#include <string>

namespace moldloft::firmware_like {

struct RunLabel {
  std::string plate = "measured";
  std::optional<std::uint64_t> seed;  // of a simulated run
  std::string begun = {};             // when, UTC, as the run's store holds it; empty in a simulated run
  const RunConditions* conditions = nullptr;  // of timing.json; null: virtual time
  std::string remark = {};                    // the operator's
};

// Plate, cell, when, by which program and the operator's remark in one line, as summary.json says it.
std::string about_run(const Json& summary);

Json summary_of(const Controller&, const RunLabel&);

// Everything that can be written for the state that the run is in: a run that did not complete
// has no surface. `error_field`, when given, is what the picture's second panel shows instead of
// the fit's residuals.
std::expected<void, RunError> write_results(const Controller&, const RunFolder&, const RunLabel&,
                                            const Json& summary,
                                            const std::optional<PlateField>& error_field = {});

}  // namespace moldloft::firmware_like
