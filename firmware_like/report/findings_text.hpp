// What the audit says of a result, for people: as lines of a table, and as the first part of the run's page.
//
// Thread       any; pure
#pragma once

#include "firmware_like/results/run_result.hpp"

#include <string>

namespace moldloft::firmware_like {

// One line each: the gravity, then what was found.
std::string findings_lines(const RunResult&);

// Of a run whose fit came to its end; empty for any other.
std::string findings_section(const RunResult&);

}  // namespace moldloft::firmware_like
