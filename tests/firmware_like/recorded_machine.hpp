// Machines as their kernels describe themselves in /proc and /sys, written below a folder of the test's own.
#pragma once

#include "hal/temporary_folder.hpp"

#include <filesystem>
#include <fstream>
#include <map>
#include <string>

namespace moldloft::test {

using MachineFiles = std::map<std::string, std::string>;

// A cell PC as the tuning guide wants it: Debian 12's real-time kernel, four processors, two of them isolated.
inline MachineFiles tuned_pc() {
  return {
      {"proc/sys/kernel/ostype", "Linux\n"},
      {"proc/sys/kernel/hostname", "cell-1\n"},
      {"proc/sys/kernel/osrelease", "6.1.0-26-rt-amd64\n"},
      {"proc/sys/kernel/version", "#1 SMP PREEMPT_RT Debian 6.1.112-1 (2024-09-30)\n"},
      {"proc/sys/kernel/arch", "x86_64\n"},
      {"proc/sys/kernel/sched_rt_runtime_us", "-1\n"},
      {"proc/sys/kernel/sched_rt_period_us", "1000000\n"},
      {"proc/irq/default_smp_affinity", "3\n"},
      {"proc/self/limits",
       "Limit                     Soft Limit           Hard Limit           Units     \n"
       "Max locked memory         unlimited            unlimited            bytes     \n"
       "Max realtime priority     60                   98                   \n"},
      {"proc/cpuinfo",
       "processor\t: 0\nmodel name\t: Intel(R) Core(TM) i5-8500 CPU @ 3.00GHz\n"
       "flags\t\t: fpu vme constant_tsc nonstop_tsc\n\nprocessor\t: 1\n"},
      {"sys/kernel/realtime", "1\n"},
      {"sys/class/dmi/id/sys_vendor", "Dell Inc.\n"},
      {"sys/class/dmi/id/product_name", "OptiPlex 7060\n"},
      {"sys/devices/system/cpu/online", "0-3\n"},
      {"sys/devices/system/cpu/isolated", "2-3\n"},
      {"sys/devices/system/cpu/nohz_full", "2-3\n"},
      {"sys/devices/system/cpu/smt/active", "0\n"},
      {"sys/devices/system/cpu/cpu0/cpufreq/scaling_governor", "powersave\n"},
      {"sys/devices/system/cpu/cpu1/cpufreq/scaling_governor", "powersave\n"},
      {"sys/devices/system/cpu/cpu2/cpufreq/scaling_governor", "performance\n"},
      {"sys/devices/system/cpu/cpu3/cpufreq/scaling_governor", "performance\n"},
      {"sys/devices/system/clocksource/clocksource0/current_clocksource", "tsc\n"},
  };
}

class RecordedMachine {
 public:
  explicit RecordedMachine(const MachineFiles& files) {
    for (const auto& [path, text] : files) {
      const auto at = folder_.path() / path;
      std::filesystem::create_directories(at.parent_path());
      std::ofstream{at, std::ios::binary} << text;
    }
  }
  const std::filesystem::path& root() const { return folder_.path(); }

 private:
  hal::TemporaryFolder folder_;
};

}  // namespace moldloft::test
