// The timing part of a run, as its timing.json holds it: how late ticks began, what every task took, what was missed
// and why, how old the data were, how far the processor was loaded, and which budgets follow from that.
//
// Names are cyclictest's where they mean the same (file_version, return_code, sysinfo, num_threads, resolution_in_ns,
// thread.0 with histogram in whole microseconds, cycles, min, max, avg, cpu, priority), so that tools which read
// `cyclictest --json` read the wake-up latency of a run. Figures are microseconds; buckets_ns counts by each
// bucket's lower limit in nanoseconds. What was not measured is null, never 0.
//
// Thread       any, when the control thread has come to rest
// Allocation   yes
// Failure      none
#pragma once

#include "firmware_like/results/environment_report.hpp"
#include "hal/base/loss_count.hpp"
#include "tasks/cell/cell.hpp"

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace moldloft::firmware_like {

// What was lost of one device's words.
struct NamedLosses {
  std::string_view of;  // "scanner", "robot"
  hal::LossCounts counts;
};

struct TimedRun {
  const tasks::Scheduler& scheduler;
  const tasks::Cell* cell = nullptr;          // null: without devices nothing is measured from end to end
  const RunConditions* conditions = nullptr;  // null: virtual time
  std::vector<NamedLosses> losses = {};       // none: nothing counts any
  std::uint64_t dumps_too_soon = 0;  // of the flight recorder, left out because another had just been made
};
Json timing_report(const TimedRun&);

// What a percentile is called in timing.json, in tables and on pages.
struct Percentile {
  double fraction;
  const char* key;
  const char* name;
};
inline constexpr std::array<Percentile, 4> percentiles{{{0.5, "p50_us", "p50"},
                                                        {0.99, "p99_us", "p99"},
                                                        {0.999, "p999_us", "p99.9"},
                                                        {0.9999, "p9999_us", "p99.99"}}};

// In `compared`, ours over cyclictest's: "ratio_p99"; of the maxima.
std::string ratio_key(const Percentile&);
inline constexpr const char* ratio_of_maxima = "ratio_max";

double micros(hal::Duration);
Json histogram_json(const tasks::Histogram&);
tasks::Histogram histogram_from(
    const Json&);  // of what histogram_json() wrote; within a bucket, as exact as that

// As many places as people read: 7.25, 72.5, 725.
std::string readable(double);
// The moment kept in milliseconds under `key`, in seconds as events and flight recorder give it; "-" where none is.
std::string moment_s(const Json&, const char* key);

// ---- budgets

// Suggested: half as much again as the 99.9th percentile; where the run is representative not less than the longest
// run either (elsewhere that is the machine's, not the task's). Rounded up to 10 us. Below 1,000 runs nobody knows
// a 99.9th percentile, so nothing is suggested.
inline constexpr std::string_view budget_rule =
    "1.5 x p99.9, in a representative run at least the maximum; rounded up to 10 us; none below 1000 runs";
inline constexpr std::uint64_t runs_for_a_budget = 1000;
std::optional<hal::Duration> suggested_budget(const tasks::Histogram& cost, bool representative);

}  // namespace moldloft::firmware_like
