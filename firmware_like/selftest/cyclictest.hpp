// cyclictest (package rt-tests), the measure that real-time people know: run for a while, read back from its JSON.
//
// Its histogram counts whole microseconds, truncated: n stands for everything from n to n + 1. Here n is counted as
// n + 0.5 us in a histogram of our own kind, so that percentiles of both follow from the same buckets by the same rule.
//
// Thread       an ordinary one
// Blocking     run_cyclictest() until cyclictest has ended
// Failure      one line: what is missing or wrong, what to do
#pragma once

#include "firmware_like/process/failure.hpp"
#include "hal/base/clock.hpp"
#include "tasks/scheduler/histogram.hpp"

#include <cstdint>
#include <expected>
#include <filesystem>
#include <string>
#include <vector>

namespace moldloft::firmware_like {

struct CyclictestSettings {
  int priority = 50;  // of SCHED_FIFO; 0: ordinary scheduling
  int cpu = -1;       // -1: any
  bool lock_memory = true;
  hal::Duration interval = std::chrono::milliseconds{1};
  std::uint64_t cycles = 5000;
};

struct CyclictestResult {
  tasks::Histogram latency;
  std::uint64_t cycles = 0;
  std::uint64_t beyond = 0;  // its histogram, which ends at cyclictest_histogram_us; counted as its max

  CyclictestResult& operator+=(const CyclictestResult& turn);
};

inline constexpr int cyclictest_histogram_us = 100'000;

std::vector<std::string> cyclictest_words(const CyclictestSettings&, const std::filesystem::path& json);
std::expected<CyclictestResult, Failure> parse_cyclictest(const std::string& json);
// `scratch`: a folder for its files, which are removed again.
std::expected<CyclictestResult, Failure> run_cyclictest(const CyclictestSettings&,
                                                        const std::filesystem::path& scratch);

}  // namespace moldloft::firmware_like
