// The deployed program under the preloaded guard, over a complete run on a TCP socket and a serial port: the control
// thread neither allocates, nor locks, nor waits, drivers and fit included.
#include "firmware_like/process/complaint.hpp"
#include "host_sim/real_devices.hpp"
#include "realtime/guarded_run.hpp"

#include <doctest/doctest.h>

#include <sys/mman.h>

using namespace moldloft;
using namespace moldloft::host_sim;
using nlohmann::json;
using test::json_in;

namespace {

// As a person who sets up a cell would have to allow it: root, CAP_IPC_LOCK, or a large limit.
bool memory_can_be_locked() {
  constexpr std::size_t more_than_a_small_limit = 64u << 20;
  void* memory = mmap(nullptr, more_than_a_small_limit, PROT_READ, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  const bool can = mlock(memory, more_than_a_small_limit) == 0;
  munmap(memory, more_than_a_small_limit);
  if (!can) MESSAGE("memory cannot be locked here (ulimit -l): page faults are counted, but not held to 0");
  return can;
}

int faults(const json& counts) {
  return counts["minor_faults"].get<int>() + counts["major_faults"].get<int>();
}

struct GuardedRun {
  json report, counts;
};

// A complete run; `breaking` names how the rule is broken once, in its middle.
GuardedRun guarded_run(const std::string& breaking = {}) {
  const Devices devices;
  const hal::TemporaryFolder folder;
  std::vector<std::string> words = {"/usr/bin/env", "MOLDLOFT_GUARD_REPORT=" + folder.file("report"),
                                    "MOLDLOFT_GUARD_BREAK=" + breaking,
                                    "LD_PRELOAD=" PTY_MODEM ":" REALTIME_GUARD};
  const auto run = run_words(devices, folder.file("run"));
  words.insert(words.end(), run.begin(), run.end());
  ChildProcess child{words};
  REQUIRE_MESSAGE(child.wait(run_limit) == firmware_like::exit_done, child.err());
  GuardedRun result{json_in(folder.file("report")),
                    json_in(folder.file("run") + "/timing.json")["control_thread"]};
  if (breaking.empty()) CHECK_MESSAGE(result.report["all"] == 0, child.err());
  return result;
}

}  // namespace

TEST_CASE("a complete run on real links neither allocates nor locks nor waits in the control thread") {
  const auto run = guarded_run();
  // The guard was awake: the section slept to its ticks and asked socket and serial port at each.
  const auto ticks = run.counts["ticks"].get<int>();
  CHECK(ticks > 10'000);
  CHECK(run.report["sleeps"].get<int>() == ticks);
  CHECK(run.report["asked"].get<int>() > ticks);
  // Whoever waits gives the CPU away. That happened at the sleeps, and rarely inside the kernel, where a
  // pseudo-terminal has locks of its own: whatever waits at every tick would double the count.
  CHECK(run.counts["voluntary_switches"].get<int>() <= ticks + ticks / 100);
  CHECK(run.counts["suspensions"] == 0);
  // Every page was there when it was needed.
  if (memory_can_be_locked()) CHECK(faults(run.counts) == 0);
}

TEST_CASE("a run that breaks the promise once, in its middle, is seen to") {
  const auto one = [](const char* how, const char* call) {
    const auto run = guarded_run(how);
    CHECK(run.report["calls"][call] == 1);
    CHECK(run.report["all"].get<int>() >= 1);
  };
  one("malloc", "malloc");
  one("lock", "pthread_mutex_lock");
  // The guard does not see a page fault, nor need it: the run's own count does.
  if (memory_can_be_locked()) CHECK(faults(guarded_run("fault").counts) >= 8);
}
