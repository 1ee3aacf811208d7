// The conditions of a run as they head its timing report: JSON, with cyclictest's names where they mean the same
// (sysinfo), and a few lines for a terminal.
#pragma once

#include "firmware_like/process/json_text.hpp"
#include "firmware_like/realtime/environment.hpp"
#include "firmware_like/realtime/thread_counts.hpp"

namespace moldloft::firmware_like {

// Under which conditions a run was timed; a run in virtual time has none.
struct RunConditions {
  RealtimeConfig realtime;
  Environment environment;
  SetupRows setup;
  ThreadCounts control_thread = {};  // what the operating system did to it
  std::uint64_t unsaid_lines = 0;    // meant for a person, and taken by nobody (console.hpp)
};

Json environment_json(const Environment&);
Json setup_json(const SetupRows&);
Json counts_json(const ThreadCounts&);

// The keys environment, setup, control_thread, representative and why; for virtual time (null) the last two alone.
void put_conditions(Json& report, const RunConditions*);

// What there is and what was had; the verdict is the last line of the figures (timing_table.hpp).
std::string conditions_text(const RunConditions&);

}  // namespace moldloft::firmware_like
