// Machines as recorded trees of /proc and /sys describe them, and the one that the test runs on as its system calls do.
#include "firmware_like/realtime/environment.hpp"

#include "firmware_like/recorded_machine.hpp"
#include "firmware_like/results/environment_report.hpp"

#include <doctest/doctest.h>

#include <sys/resource.h>
#include <sys/utsname.h>
#include <unistd.h>

using namespace moldloft;
using namespace moldloft::firmware_like;
using test::MachineFiles;

namespace {

using Reasons = std::vector<std::string>;

Environment environment_of(const MachineFiles& files, int cpu = 2) {
  const test::RecordedMachine machine{files};
  return read_environment(cpu, machine.root());
}

MachineFiles tuned_pc_but(const std::string& path, const std::string& text) {
  MachineFiles files = test::tuned_pc();
  files[path] = text;
  return files;
}

SetupRows all_granted() {
  SetupRows rows;
  for (const auto item :
       {SetupItem::scheduling, SetupItem::memory_lock, SetupItem::cpu_latency, SetupItem::affinity})
    rows.push_back({.item = item, .wanted = "it", .got = "it", .ok = true, .real_time = true, .hint = ""});
  return rows;
}

SetupRows granted_but(SetupItem item) {
  SetupRows rows = all_granted();
  for (auto& row : rows) row.real_time = row.real_time && row.item != item;
  return rows;
}

Reasons reasons(const MachineFiles& files, const SetupRows& rows = all_granted(), int cpu = 2) {
  return verdict_on(environment_of(files, cpu), rows, {.cpu = cpu}).reasons;
}

}  // namespace

TEST_CASE("a tuned cell PC is described as its files say, and is representative") {
  const Environment e = environment_of(test::tuned_pc());
  CHECK(e.sysname == "Linux");
  CHECK(e.nodename == "cell-1");
  CHECK(e.release == "6.1.0-26-rt-amd64");
  CHECK(e.version == "#1 SMP PREEMPT_RT Debian 6.1.112-1 (2024-09-30)");
  CHECK(e.machine == "x86_64");
  CHECK(e.realtime);
  CHECK(e.realtime_found_by == "/sys/kernel/realtime and the kernel's version");
  CHECK(e.cpu_model == "Intel(R) Core(TM) i5-8500 CPU @ 3.00GHz");
  CHECK(e.cpus == 4);
  CHECK(e.smt_active == false);
  CHECK(e.governor == "performance");
  CHECK(e.isolated == "2-3");
  CHECK(e.nohz_full == "2-3");
  CHECK(e.irq_affinity == "3");
  CHECK(e.rt_runtime_us == -1);
  CHECK(e.rt_period_us == 1000000);
  CHECK(e.clock_source == "tsc");
  CHECK(e.memlock_limit == "unlimited");
  CHECK(e.rtprio_limit == "60");
  CHECK_FALSE(e.virtual_machine);
  const Verdict verdict = verdict_on(e, all_granted(), {.cpu = 2});
  CHECK(verdict.representative);
  CHECK(verdict.why() == "");
}

// A working real-time kernel without the flag was turned away by a robot's driver for years.
TEST_CASE("PREEMPT_RT is found by the flag or by the version, and the report says by which") {
  MachineFiles files = test::tuned_pc();
  files.erase("sys/kernel/realtime");
  CHECK(environment_of(files).realtime_found_by == "the kernel's version");
  files["proc/sys/kernel/version"] = "#1 SMP PREEMPT RT 4.19.59-rt24\n";
  CHECK(environment_of(files).realtime_found_by == "the kernel's version");
  files["proc/sys/kernel/version"] = "#1 SMP PREEMPT_DYNAMIC Debian 6.1.112-1\n";
  CHECK_FALSE(environment_of(files).realtime);
  CHECK(reasons(files) == Reasons{"the kernel is not PREEMPT_RT"});
  files["sys/kernel/realtime"] = "0\n";
  CHECK_FALSE(environment_of(files).realtime);
  files["sys/kernel/realtime"] = "1\n";
  CHECK(environment_of(files).realtime_found_by == "/sys/kernel/realtime");
  CHECK(reasons(files).empty());
}

TEST_CASE(
    "a virtual machine is found by processor, firmware, hypervisor or device tree, and is never "
    "representative") {
  const std::string flags = "model name\t: AMD EPYC\nflags\t\t: fpu hypervisor lahf_lm\n";
  const auto found_by = [](const MachineFiles& files) {
    CHECK(reasons(files) == Reasons{"a virtual machine"});  // although everything else is as it should be
    return environment_of(files).virtual_found_by;
  };
  CHECK(found_by(tuned_pc_but("proc/cpuinfo", flags)) == "the processor's hypervisor flag");
  CHECK(found_by(tuned_pc_but("sys/class/dmi/id/sys_vendor", "QEMU\n")) == "the firmware: QEMU");
  CHECK(found_by(tuned_pc_but("sys/class/dmi/id/product_name", "VMware7,1\n")) == "the firmware: VMware7,1");
  CHECK(found_by(tuned_pc_but("sys/hypervisor/type", "xen\n")) == "/sys/hypervisor/type: xen");
  CHECK(found_by(tuned_pc_but("proc/device-tree/hypervisor/compatible", std::string{"linux,kvm\0", 10})) ==
        "the device tree: linux,kvm");
  CHECK(reasons(tuned_pc_but("proc/cpuinfo", "flags\t\t: fpu hypervisor_guest_bits\n")).empty());
}

TEST_CASE("a virtual machine without PREEMPT_RT, set up by an ordinary user, has all reasons against it") {
  MachineFiles files = tuned_pc_but("proc/cpuinfo", "flags\t\t: hypervisor\n");
  files["sys/kernel/realtime"] = "0\n";
  files["proc/sys/kernel/version"] = "#1 SMP PREEMPT_DYNAMIC\n";
  files["sys/devices/system/clocksource/clocksource0/current_clocksource"] = "hpet\n";
  const Verdict verdict = verdict_on(environment_of(files, -1), {}, {});
  CHECK_FALSE(verdict.representative);
  CHECK(verdict.why() ==
        "the kernel is not PREEMPT_RT; a virtual machine; the control thread has no FIFO priority; memory is "
        "not locked; "
        "processors may sleep deeply; the control thread has no processor of its own; the frequency governor "
        "is "
        "performance, powersave, not performance; the clock source is hpet");
}

TEST_CASE("each thing that is missing alone makes a report not representative") {
  const MachineFiles pc = test::tuned_pc();
  CHECK(reasons(pc, granted_but(SetupItem::scheduling)) ==
        Reasons{"the control thread has no FIFO priority"});
  CHECK(reasons(pc, granted_but(SetupItem::memory_lock)) == Reasons{"memory is not locked"});
  CHECK(reasons(pc, granted_but(SetupItem::cpu_latency)) == Reasons{"processors may sleep deeply"});
  CHECK(reasons(pc, granted_but(SetupItem::affinity)) ==
        Reasons{"the control thread has no processor of its own"});
  CHECK(reasons(pc, all_granted(), 1) ==
        Reasons{"CPU 1 is not isolated", "the frequency governor is powersave, not performance"});
  CHECK(reasons(tuned_pc_but("sys/devices/system/cpu/isolated", "\n")) == Reasons{"CPU 2 is not isolated"});
  CHECK(reasons(tuned_pc_but("sys/devices/system/clocksource/clocksource0/current_clocksource",
                             "acpi_pm\n")) == Reasons{"the clock source is acpi_pm"});
}

TEST_CASE("lists of processors are read with ranges") {
  CHECK(cpu_in_list(2, "0,2-3"));
  CHECK(cpu_in_list(3, "0,2-3"));
  CHECK(cpu_in_list(0, "0,2-3"));
  CHECK_FALSE(cpu_in_list(1, "0,2-3"));
  CHECK_FALSE(cpu_in_list(0, ""));
  CHECK(cpu_in_list(12, "12"));
  CHECK_FALSE(cpu_in_list(1, "12"));
}

TEST_CASE("a machine that says nothing is unknown, not good") {
  const Environment e = environment_of({});
  CHECK(e.cpus == 0);
  CHECK_FALSE(e.rt_runtime_us.has_value());
  CHECK_FALSE(e.smt_active.has_value());
  CHECK_FALSE(verdict_on(e, {}, {}).representative);
  const Json j = environment_json(e);
  for (const char* key : {"realtime_found_by", "governor", "rt_runtime_us", "clock_source",
                          "memlock_limit_bytes", "smt_active"}) {
    CAPTURE(key);
    CHECK(j[key].is_null());
  }
  CHECK(conditions_text({{}, e, {}}).find("real-time throttling unknown") != std::string::npos);
}

TEST_CASE("this machine is described as its system calls describe it") {
  const Environment e = read_environment(-1);
  utsname name{};
  REQUIRE(uname(&name) == 0);
  CHECK(e.sysname == name.sysname);
  CHECK(e.nodename == name.nodename);
  CHECK(e.release == name.release);
  CHECK(e.version == name.version);
  CHECK(e.cpus == sysconf(_SC_NPROCESSORS_ONLN));
  rlimit limit{};
  getrlimit(RLIMIT_MEMLOCK, &limit);
  CHECK(e.memlock_limit == (limit.rlim_cur == RLIM_INFINITY ? "unlimited" : std::to_string(limit.rlim_cur)));
  getrlimit(RLIMIT_RTPRIO, &limit);
  CHECK(e.rtprio_limit == (limit.rlim_cur == RLIM_INFINITY ? "unlimited" : std::to_string(limit.rlim_cur)));
}

TEST_CASE("the JSON has the names of cyclictest where they mean the same, and the rows of the set-up") {
  RunConditions conditions{{.cpu = 2}, environment_of(test::tuned_pc()), granted_but(SetupItem::memory_lock)};
  conditions.setup[1].hint = "raise the limit";
  Json j;
  put_conditions(j, &conditions);
  CHECK(j["environment"]["sysinfo"]["realtime"] == 1);
  CHECK(j["environment"]["sysinfo"]["release"] == "6.1.0-26-rt-amd64");
  CHECK(j["environment"]["rt_runtime_us"] == -1);
  CHECK(j["setup"].size() == 4);
  CHECK(j["setup"][1]["what"] == "memory lock");
  CHECK(j["setup"][1]["hint"] == "raise the limit");
  CHECK(j["representative"] == false);
  CHECK(j["why"] == "memory is not locked");

  Json simulated;
  put_conditions(simulated, nullptr);
  CHECK(simulated == Json{{"representative", false}, {"why", "virtual time"}});
}

TEST_CASE("the text for a terminal says what there is, what was had, and what not") {
  RunConditions conditions{{.cpu = 2}, environment_of(test::tuned_pc()), all_granted()};
  const std::string good = conditions_text(conditions);
  CHECK(good.find("kernel              6.1.0-26-rt-amd64 #1 SMP PREEMPT_RT Debian 6.1.112-1 (2024-09-30), "
                  "PREEMPT_RT by "
                  "/sys/kernel/realtime and the kernel's version\n") != good.npos);
  CHECK(good.find("                    isolated 2-3, nohz_full 2-3, SMT off, governor performance\n") !=
        good.npos);
  CHECK(good.find("real-time throttling off\n") != good.npos);
  CHECK(good.find("limits              memlock unlimited, rtprio 60\n") != good.npos);
  conditions.setup[0] = {
      .item = SetupItem::scheduling, .wanted = "SCHED_FIFO 50", .got = "SCHED_OTHER", .hint = "ask for it"};
  const std::string bad = conditions_text(conditions);
  CHECK(bad.find("scheduling          SCHED_OTHER, wanted SCHED_FIFO 50: ask for it\n") != bad.npos);
  conditions.environment.memlock_limit = "8388608";
  conditions.setup.push_back(
      {.item = SetupItem::ordinary_threads, .wanted = "", .got = "2 of 2 threads", .ok = true, .hint = ""});
  const std::string limited = conditions_text(conditions);
  CHECK(limited.find("memlock 8388608 bytes, ") != limited.npos);
  CHECK(limited.find("ordinary threads    2 of 2 threads\n") != limited.npos);
}
