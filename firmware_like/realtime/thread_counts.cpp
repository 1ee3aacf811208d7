#include "firmware_like/realtime/thread_counts.hpp"

#include "hal/base/realtime_section.hpp"

#include <sched.h>
#include <sys/resource.h>

namespace moldloft::firmware_like {
namespace {

ThreadCounts counts_now() noexcept {
  rusage usage{};
  getrusage(RUSAGE_THREAD, &usage);
  ThreadCounts counts;
  counts.minor_faults = static_cast<std::uint64_t>(usage.ru_minflt);
  counts.major_faults = static_cast<std::uint64_t>(usage.ru_majflt);
  counts.voluntary_switches = static_cast<std::uint64_t>(usage.ru_nvcsw);
  counts.involuntary_switches = static_cast<std::uint64_t>(usage.ru_nivcsw);
  counts.suspensions = static_cast<std::uint64_t>(hal::PromiseSuspended::suspensions());
  return counts;
}

}  // namespace

ThreadCounts& ThreadCounts::operator+=(const ThreadCounts& other) noexcept {
  ticks += other.ticks;
  minor_faults += other.minor_faults;
  major_faults += other.major_faults;
  voluntary_switches += other.voluntary_switches;
  involuntary_switches += other.involuntary_switches;
  migrations += other.migrations;
  suspensions += other.suspensions;
  return *this;
}

ThreadCounter::ThreadCounter() noexcept : start_{counts_now()}, cpu_{sched_getcpu()} {}

void ThreadCounter::at_tick() noexcept {
  ++ticks_;
  const int cpu = sched_getcpu();
  if (cpu != cpu_) ++migrations_;
  cpu_ = cpu;
}

ThreadCounts ThreadCounter::so_far() const noexcept {
  ThreadCounts counts = counts_now();
  counts.ticks = ticks_;
  counts.minor_faults -= start_.minor_faults;
  counts.major_faults -= start_.major_faults;
  counts.voluntary_switches -= start_.voluntary_switches;
  counts.involuntary_switches -= start_.involuntary_switches;
  counts.migrations = migrations_;
  counts.suspensions -= start_.suspensions;
  return counts;
}

}  // namespace moldloft::firmware_like
