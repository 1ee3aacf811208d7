#include "firmware_like/realtime/environment.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <fstream>
#include <set>
#include <sstream>

namespace moldloft::firmware_like {
namespace {

namespace fs = std::filesystem;

// The files below one root, without the line end that most of them have.
class Files {
 public:
  explicit Files(fs::path root) : root_{std::move(root)} {}

  std::string text(const std::string& path) const {
    std::ostringstream all;
    all << std::ifstream{root_ / path, std::ios::binary}.rdbuf();
    std::string text = all.str();
    while (!text.empty() && (text.back() == '\n' || text.back() == '\0' || text.back() == ' '))
      text.pop_back();
    return text;
  }
  std::optional<long> number(const std::string& path) const {
    const std::string value = text(path);
    char* end = nullptr;
    const long number = std::strtol(value.c_str(), &end, 10);
    return value.empty() || *end != '\0' ? std::nullopt : std::optional{number};
  }

 private:
  fs::path root_;
};

// What stands behind the first line that begins so, without blanks and colon.
std::string value_of(const std::string& text, std::string_view key) {
  std::istringstream lines{text};
  for (std::string line; std::getline(lines, line);) {
    if (!line.starts_with(key)) continue;
    const auto begin = line.find_first_not_of(" \t:", key.size());
    return begin == line.npos ? "" : line.substr(begin);
  }
  return {};
}

std::vector<int> cpus_in(const std::string& list) {
  std::vector<int> cpus;
  std::istringstream parts{list};
  for (std::string part; std::getline(parts, part, ',');) {
    int first = 0, last = 0;
    const int read = std::sscanf(part.c_str(), "%d-%d", &first, &last);
    if (read < 1) continue;
    for (int cpu = first; cpu <= (read == 2 ? last : first); ++cpu) cpus.push_back(cpu);
  }
  return cpus;
}

// The flag is missing on kernels that have the patches but not the file; the version tells of either.
std::string realtime_found_by(const Files& files, const std::string& version) {
  const bool flag = files.text("sys/kernel/realtime") == "1";
  const bool named = version.find("PREEMPT_RT") != version.npos || version.find("PREEMPT RT") != version.npos;
  if (flag && named) return "/sys/kernel/realtime and the kernel's version";
  return flag ? "/sys/kernel/realtime" : named ? "the kernel's version" : "";
}

// Vendors and products that firmware of virtual machines reports, as systemd-detect-virt knows them.
constexpr std::array<std::string_view, 14> virtual_firmware = {"KVM",
                                                               "QEMU",
                                                               "OpenStack",
                                                               "KubeVirt",
                                                               "VMware",
                                                               "VMW",
                                                               "innotek GmbH",
                                                               "VirtualBox",
                                                               "Xen",
                                                               "Bochs",
                                                               "Parallels",
                                                               "BHYVE",
                                                               "Virtual Machine",
                                                               "Google Compute Engine"};

std::string virtual_found_by(const Files& files, const std::string& cpuinfo) {
  if ((" " + value_of(cpuinfo, "flags") + " ").find(" hypervisor ") != std::string::npos)
    return "the processor's hypervisor flag";
  for (const char* file : {"sys_vendor", "product_name", "board_vendor", "bios_vendor"}) {
    const std::string text = files.text(std::string{"sys/class/dmi/id/"} + file);
    const bool known = std::ranges::any_of(
        virtual_firmware, [&](std::string_view name) { return text.find(name) != text.npos; });
    if (known) return "the firmware: " + text;
  }
  if (const std::string type = files.text("sys/hypervisor/type"); !type.empty())
    return "/sys/hypervisor/type: " + type;
  if (const std::string type = files.text("proc/device-tree/hypervisor/compatible"); !type.empty())
    return "the device tree: " + type;
  return {};
}

std::string governors(const Files& files, int control_cpu, const std::string& online) {
  std::set<std::string> all;
  for (const int cpu : control_cpu >= 0 ? std::vector{control_cpu} : cpus_in(online)) {
    const std::string governor =
        files.text(fmt::format("sys/devices/system/cpu/cpu{}/cpufreq/scaling_governor", cpu));
    if (!governor.empty()) all.insert(governor);
  }
  return fmt::format("{}", fmt::join(all, ", "));
}

// A name on a PC; other processors give numbers, and their board has the name.
std::string cpu_model(const Files& files, const std::string& cpuinfo) {
  for (const char* key : {"model name", "Model", "Hardware"}) {
    if (std::string name = value_of(cpuinfo, key); !name.empty()) return name;
  }
  return files.text("proc/device-tree/model");
}

// The third column of /proc/self/limits is the soft limit; names have blanks.
std::string soft_limit(const std::string& limits, std::string_view name) {
  const std::string rest = value_of(limits, name);
  return rest.substr(0, rest.find(' '));
}

bool is_in_force(const SetupRows& rows, SetupItem item) {
  const auto row = std::ranges::find(rows, item, &SetupRow::item);
  return row != rows.end() && row->real_time;
}

// Reading one of these takes a microsecond or more, or it stands still for a jiffy.
bool is_slow_clock(const std::string& source) {
  return source == "hpet" || source == "acpi_pm" || source == "jiffies" || source == "refined-jiffies";
}

}  // namespace

bool cpu_in_list(int cpu, const std::string& list) {
  const auto cpus = cpus_in(list);
  return std::ranges::find(cpus, cpu) != cpus.end();
}

Environment read_environment(int control_cpu, const fs::path& root) {
  const Files files{root};
  const std::string cpuinfo = files.text("proc/cpuinfo"), limits = files.text("proc/self/limits");
  Environment e;
  e.sysname = files.text("proc/sys/kernel/ostype");
  e.nodename = files.text("proc/sys/kernel/hostname");
  e.release = files.text("proc/sys/kernel/osrelease");
  e.version = files.text("proc/sys/kernel/version");
  e.machine = files.text("proc/sys/kernel/arch");
  e.realtime_found_by = realtime_found_by(files, e.version);
  e.realtime = !e.realtime_found_by.empty();
  e.cpu_model = cpu_model(files, cpuinfo);
  e.cpus_online = files.text("sys/devices/system/cpu/online");
  e.cpus = static_cast<int>(cpus_in(e.cpus_online).size());
  if (const auto smt = files.number("sys/devices/system/cpu/smt/active")) e.smt_active = *smt != 0;
  e.governor = governors(files, control_cpu, e.cpus_online);
  e.isolated = files.text("sys/devices/system/cpu/isolated");
  e.nohz_full = files.text("sys/devices/system/cpu/nohz_full");
  if (e.nohz_full.find("null") != std::string::npos)
    e.nohz_full.clear();  // "(null)": built in, not asked for
  e.irq_affinity = files.text("proc/irq/default_smp_affinity");
  e.rt_runtime_us = files.number("proc/sys/kernel/sched_rt_runtime_us");
  e.rt_period_us = files.number("proc/sys/kernel/sched_rt_period_us");
  e.clock_source = files.text("sys/devices/system/clocksource/clocksource0/current_clocksource");
  e.memlock_limit = soft_limit(limits, "Max locked memory");
  e.rtprio_limit = soft_limit(limits, "Max realtime priority");
  e.virtual_found_by = virtual_found_by(files, cpuinfo);
  e.virtual_machine = !e.virtual_found_by.empty();
  return e;
}

std::string Verdict::why() const { return fmt::format("{}", fmt::join(reasons, "; ")); }

Verdict verdict_on(const Environment& e, const SetupRows& rows, const RealtimeConfig& config) {
  Verdict v;
  const auto reason = [&](bool holds, std::string text) {
    if (holds) v.reasons.push_back(std::move(text));
  };
  reason(!e.realtime, "the kernel is not PREEMPT_RT");
  reason(e.virtual_machine, "a virtual machine");
  reason(!is_in_force(rows, SetupItem::scheduling), "the control thread has no FIFO priority");
  reason(!is_in_force(rows, SetupItem::memory_lock), "memory is not locked");
  reason(!is_in_force(rows, SetupItem::cpu_latency), "processors may sleep deeply");
  const bool pinned = is_in_force(rows, SetupItem::affinity);
  reason(!pinned, "the control thread has no processor of its own");
  reason(pinned && !cpu_in_list(config.cpu, e.isolated), fmt::format("CPU {} is not isolated", config.cpu));
  reason(!e.governor.empty() && e.governor != "performance",
         fmt::format("the frequency governor is {}, not performance", e.governor));
  reason(is_slow_clock(e.clock_source), fmt::format("the clock source is {}", e.clock_source));
  v.representative = v.reasons.empty();
  return v;
}

}  // namespace moldloft::firmware_like
