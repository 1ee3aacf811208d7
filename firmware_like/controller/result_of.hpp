// The result of a run, taken from its controller when the cell has come to rest.
#pragma once

#include "firmware_like/controller/controller.hpp"
#include "firmware_like/results/environment_report.hpp"
#include "firmware_like/results/run_result.hpp"

namespace moldloft::firmware_like {

Outcome outcome_of(const Controller&);

// `conditions`: under which the run was timed; null in virtual time.
RunResult result_of(const Controller&, const RunLabel&, const RunConditions* conditions = nullptr);

}  // namespace moldloft::firmware_like
