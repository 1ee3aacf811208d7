// surface.step and surface.igs: the measured surface for CAD systems, untrimmed, in millimetres
// and world coordinates.
//
// The bytes depend on the surface and on what is passed in, never on the time of writing: the time stamp in
// the files is the moment when the run began. A simulated run has none, and its files say 1970-01-01.
//
// Failure      one line that says what is wrong with the surface
#pragma once

#include "firmware_like/process/failure.hpp"
#include "firmware_like/results/run_result.hpp"

#include <expected>
#include <optional>
#include <string>

namespace moldloft::firmware_like {

struct CadFacts {
  std::string plate = "measured";
  std::string cell = {}, remark = {}, program = {};  // empty: not known
  std::string begun = {};                            // "2026-11-25T15:04:05Z"; empty: not known
  std::optional<double> noise_mm = {};               // of one measured point about the surface
  std::optional<double> tolerance_mm = {};           // what the fit was allowed to miss, rms
};

CadFacts cad_facts(const RunResult&);

// `file_name` is what the file says that it is called.
std::expected<std::string, Failure> step_file(const geometry::BSplineSurface&, const CadFacts&,
                                              const std::string& file_name);
std::expected<std::string, Failure> iges_file(const geometry::BSplineSurface&, const CadFacts&,
                                              const std::string& file_name);

}  // namespace moldloft::firmware_like
