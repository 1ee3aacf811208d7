// The table that ends a run, for a person at a terminal: plain, aligned.
//
// Thread       any; pure
#pragma once

#include "firmware_like/results/run_result.hpp"

#include <string>

namespace moldloft::firmware_like {

std::string result_table(const RunResult&, const std::string& folder);

}  // namespace moldloft::firmware_like
