// summary.json: the run's result in figures, and back from there. It depends on the run alone, never on the machine: a
// simulated run with the same seed gives the same bytes.
//
// Thread       any; pure
// Failure      read_summary(): one line, of a file of another version or another program
#pragma once

#include "firmware_like/process/failure.hpp"
#include "firmware_like/results/run_result.hpp"

#include <expected>
#include <string>

namespace moldloft::firmware_like {

Json summary_json(const RunResult&);

// The part of the result that the summary holds. Surface, track and timing are elsewhere (stored_result.hpp).
std::expected<RunResult, Failure> read_summary(const Json&);

// What any summary says of whose surface it is, and of how it was fitted: label, cell and program, noise and tolerance
// of a measured plate. What it does not say, or says in another way, stays empty.
RunResult named_in(const Json& summary);

// Plate, cell, when, by which program and the operator's remark in one line.
std::string about_run(const RunResult&);

}  // namespace moldloft::firmware_like
