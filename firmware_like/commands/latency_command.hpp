// `moldloft latency`: the timing self-test. The deployed scheduler ticks on the real clock with the process
// set up as for a run. The surface fit runs in every slack, and the recorder writes a real run store.
// cyclictest takes turns with it if asked for. The value returned is the program's exit code: 0 when the
// measurement succeeded, whatever its figures.
#pragma once

#include "firmware_like/results/timing_report.hpp"
#include "firmware_like/selftest/cyclictest.hpp"

#include <optional>
#include <string>

namespace moldloft::firmware_like {

inline constexpr double longest_latency_s = 30 * 24 * 3600.0;

struct LatencyOptions {
  double duration_s = 30;  // of the whole measurement; with compare each side gets half of it
  std::string compare;     // "cyclictest", or empty
  bool json = false;
  std::string out;     // where run store and report stay; empty: nowhere
  int tick_us = 0;     // 0: the configuration's
  std::string config;  // a cell's, for its [realtime], tick and scanner; empty: the defaults
};
int measure_latency(const LatencyOptions&);

// ---- parts, for their tests

// How a duration is cut into turns of about five seconds.
struct TurnPlan {
  int turns = 1;
  std::int64_t ticks = 0;  // of one turn, ours as well as cyclictest's
};
TurnPlan plan_turns(double duration_s, hal::Duration tick, bool compare);

// The options that make cyclictest's turns like ours: priority, interval, processor and memory lock, as
// granted to ours.
CyclictestSettings same_as(const RunConditions&, hal::Duration tick, std::int64_t ticks);

// Both wake-up latencies, their ratios, and how they were made comparable.
Json comparison_json(const tasks::Histogram& ours, const CyclictestResult& cyclictest);

// What --json prints.
Json latency_json(const Json& timing);

}  // namespace moldloft::firmware_like
