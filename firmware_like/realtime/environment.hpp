// The machine that a timing report is about. What decides whether its figures mean anything is read from the
// kernel's files, and judged. A report without it has been taken for a defect of the program more than once
// where the kernel or the governor was at fault.
//
// Thread       any ordinary one
// Blocking     yes: reads some dozen small files
// Allocation   yes
// Failure      none: what cannot be read is empty, and said to be unknown
#pragma once

#include "firmware_like/realtime/process_setup.hpp"

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace moldloft::firmware_like {

struct Environment {
  std::string sysname, nodename, release, version, machine;  // as uname says
  bool realtime = false;                                     // PREEMPT_RT
  std::string realtime_found_by;                             // empty when it is none
  std::string cpu_model;
  std::string cpus_online;  // "0-3"
  int cpus = 0;
  std::optional<bool> smt_active;
  std::string governor;  // of the control thread's CPU, or all that there are; empty: none reported
  std::string isolated, nohz_full;                  // lists of CPUs
  std::string irq_affinity;                         // the mask new interrupts begin with
  std::optional<long> rt_runtime_us, rt_period_us;  // throttling; a runtime of -1: off
  std::string clock_source;
  std::string memlock_limit, rtprio_limit;  // of this process, soft; "unlimited" or a number
  bool virtual_machine = false;
  std::string virtual_found_by;
};

// `control_cpu`: the control thread's, -1 for any. `root`: where /proc and /sys are found.
Environment read_environment(int control_cpu, const std::filesystem::path& root = "/");

bool cpu_in_list(int cpu, const std::string& list);  // 2 in "0,2-3"

struct Verdict {
  bool representative = false;
  std::vector<std::string> reasons;  // why not
  std::string why() const;           // in one line; empty when representative
};

// Representative: the figures say what the program does on a machine of the kind that it is meant for. A virtual
// machine never is: its processors are taken away from it without its knowing.
Verdict verdict_on(const Environment&, const SetupRows&, const RealtimeConfig&);

}  // namespace moldloft::firmware_like
