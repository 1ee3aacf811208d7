// What the operating system gives and refuses, looked at with other eyes than the set-up's own: /proc, a second reader
// of the device, page faults counted by the kernel. Each case runs in a child process of its own.
#include "firmware_like/realtime/process_setup.hpp"

#include "firmware_like/forked.hpp"
#include "firmware_like/realtime/control_thread.hpp"
#include "hal/file_text.hpp"
#include "hal/temporary_folder.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cerrno>
#include <fcntl.h>
#include <filesystem>
#include <fstream>
#include <pthread.h>
#include <sched.h>
#include <sstream>
#include <thread>
#include <vector>

using namespace moldloft;
using namespace moldloft::firmware_like;
using hal::text_of;
using nlohmann::json;
using test::in_child;

namespace {

#if defined(__SANITIZE_ADDRESS__)
constexpr bool own_allocator = true;  // it takes neither mallopt nor mlockall
#else
constexpr bool own_allocator = false;
#endif

json as_json(const SetupRows& rows) {
  json all = json::object();
  for (const auto& row : rows) {
    all[std::string{to_string(row.item)}] = {{"wanted", row.wanted},
                                             {"got", row.got},
                                             {"ok", row.ok},
                                             {"real_time", row.real_time},
                                             {"hint", row.hint}};
  }
  return all;
}

std::string status_of(const std::string& key) {
  std::ifstream file{"/proc/thread-self/status"};
  for (std::string line; std::getline(file, line);) {
    if (line.starts_with(key + ":\t")) return line.substr(key.size() + 2);
  }
  return {};
}

// "policy priority" as /proc has it: fields 41 and 40, counted after the command's name, which may hold blanks.
std::string scheduling_of(pid_t thread) {
  const std::string stat = text_of(fmt::format("/proc/self/task/{}/stat", thread));
  std::istringstream fields{stat.substr(stat.rfind(')') + 2)};
  std::vector<std::string> all;
  for (std::string field; fields >> field;) all.push_back(field);
  return all.at(38) + " " + all.at(37);
}

long faults() {
  rusage usage{};
  getrusage(RUSAGE_THREAD, &usage);
  return usage.ru_minflt;
}

[[gnu::noinline]] long faults_of_a_deep_call(std::size_t bytes) {
  const long before = faults();
  auto* frame = static_cast<volatile char*>(__builtin_alloca(bytes));
  for (std::size_t i = 0; i < bytes; i += 4096) frame[i] = 1;
  return faults() - before;
}

[[gnu::noinline]] long faults_of_an_allocation(std::size_t bytes) {
  const long before = faults();
  auto* block = static_cast<volatile char*>(std::malloc(bytes));
  for (std::size_t i = 0; i < bytes; i += 4096) block[i] = 1;
  const long met = faults() - before;
  std::free(const_cast<char*>(block));
  return met;
}

// Memory and threads that a program asks for later on.
std::string grow() {
  std::vector<char> large(64 << 20, 1);
  std::vector<std::thread> threads;
  for (int i = 0; i < 4; ++i) threads.emplace_back([] {});
  for (auto& thread : threads) thread.join();
  return large.back() == 1 ? "grown" : "lost";
}

int last_cpu() {
  cpu_set_t cpus;
  CPU_ZERO(&cpus);
  sched_getaffinity(0, sizeof cpus, &cpus);
  int last = 0;
  for (int i = 0; i < CPU_SETSIZE; ++i) last = CPU_ISSET(i, &cpus) ? i : last;
  return last;
}

const std::string no_device = "/nowhere/cpu_dma_latency";

}  // namespace

TEST_CASE("with the rights to it the process gets everything, as the kernel itself shows" *
          doctest::skip(!test::is_root() || own_allocator)) {
  const int cpu = last_cpu();
  const auto seen = json::parse(in_child({}, [cpu] {
    json j;
    {
      const ProcessSetup process{{.cpu = cpu}};
      ControlThread control{{.priority = 37, .cpu = cpu}, [&] {
                              j["scheduling"] = scheduling_of(gettid());
                              j["cpus"] = status_of("Cpus_allowed_list");
                            }};
      j["locked"] = std::stol(status_of("VmLck"));
      j["resident"] = std::stol(status_of("VmRSS"));
      j["rows"] = as_json(process.rows());
      j["rows"].update(as_json(control.setup()));
      control.begin();
      control.join();
    }
    j["locked after"] = std::stol(status_of("VmLck"));
    return j.dump();
  }));
  CAPTURE(seen.dump(1));
  CHECK(seen["scheduling"] == fmt::format("{} 37", SCHED_FIFO));
  CHECK(seen["cpus"] == std::to_string(cpu));
  CHECK(seen["locked"].get<long>() + 64 >= seen["resident"].get<long>());
  CHECK(seen["locked after"] == 0);
  CHECK(seen["rows"]["scheduling"]["got"] == "SCHED_FIFO 37");
  CHECK(seen["rows"]["affinity"]["got"] == fmt::format("CPU {}", cpu));
  for (const auto& [item, row] : seen["rows"].items()) {
    CAPTURE(item);
    if (item == "CPU latency") continue;  // a container may hide the device; see below
    CHECK(row["ok"] == true);
    CHECK(row["real_time"] == true);
    CHECK(row["hint"] == "");
  }
}

TEST_CASE("the request for low CPU latency holds as long as the object lives" *
          doctest::skip(::access(cpu_latency_device, R_OK | W_OK) != 0)) {
  // The kernel answers with the lowest request of the whole machine, where other cells may run too: only
  // while our own request stands is the answer ours to foretell. After it, our own file must be closed.
  const auto others_see = [] {
    std::int32_t us = -1;
    std::ifstream{cpu_latency_device, std::ios::binary}.read(reinterpret_cast<char*>(&us), sizeof us);
    return us;
  };
  const auto requests = [] {
    return std::ranges::count_if(std::filesystem::directory_iterator{"/proc/self/fd"}, [](const auto& fd) {
      std::error_code closed;
      return std::filesystem::read_symlink(fd, closed) == cpu_latency_device;
    });
  };
  const auto seen = json::parse(in_child({}, [&] {
    json j;
    j["before"] = requests();
    {
      const ProcessSetup process{{.lock_memory = false, .cpu_latency_us = 3}};
      j["others see"] = others_see();
      j["while"] = requests();
      j["row"] = as_json(process.rows())["CPU latency"];
    }
    j["after"] = requests();
    return j.dump();
  }));
  CHECK(seen["others see"].get<int>() <= 3);
  CHECK(seen["row"]["ok"] == true);
  CHECK(seen["before"] == 0);
  CHECK(seen["while"] == 1);
  CHECK(seen["after"] == 0);
}

TEST_CASE("a latency device that is missing or refuses is told by its path and the reason") {
  const auto row = [](const std::string& device) {
    return json::parse(in_child({}, [&] {
      return as_json(ProcessSetup{{.lock_memory = false}, device}.rows())["CPU latency"].dump();
    }));
  };
  CHECK(row(no_device)["ok"] == false);
  CHECK(row(no_device)["real_time"] == false);
  CHECK(row(no_device)["got"] == "as the machine likes");
  CHECK(row(no_device)["hint"].get<std::string>().starts_with(no_device +
                                                              ": No such file or directory; give the "));
  CHECK(row("/dev/full")["ok"] == false);
  CHECK(row("/dev/full")["hint"].get<std::string>().starts_with("/dev/full: No space left on device; "));
}

TEST_CASE("without rights nothing is had, everything is said, and the process goes on" *
          doctest::skip(!test::is_root())) {
  const auto seen = json::parse(in_child({.nobody = true, .memlock_bytes = 0}, [] {
    const ProcessSetup process{{}, no_device};
    ControlThread control{{}, [] {}};
    json rows = as_json(process.rows());
    rows.update(as_json(control.setup()));
    rows["grown"] = grow();
    rows["scheduling now"] = scheduling_of(control.id());
    return rows.dump();
  }));
  CHECK(seen["memory lock"]["ok"] == false);
  CHECK(seen["memory lock"]["got"].get<std::string>().starts_with("0 KiB locked, "));
  CHECK(seen["memory lock"]["hint"].get<std::string>().starts_with(
      "the limit is 0 KiB: LimitMEMLOCK=infinity in "));
  CHECK(seen["scheduling"]["ok"] == false);
  CHECK(seen["scheduling"]["wanted"] == "SCHED_FIFO 60");
  CHECK(seen["scheduling"]["got"] == "SCHED_OTHER");
  CHECK(seen["scheduling"]["real_time"] == false);
  CHECK(seen["scheduling"]["hint"].get<std::string>().starts_with(
      "Operation not permitted; the limit is 0: LimitRTPRIO=60 in the service unit, or rtprio 60 in "));
  CHECK(seen["scheduling now"] == "0 0");
  CHECK(seen["control stack"]["ok"] == true);  // needs no rights
  CHECK(seen["grown"] == "grown");
}

// The trap: locking the pages of the future succeeds while the limit has room, and a thread fails later.
// A small program of its own, since only such a one fits into a limit that an ordinary user has.
TEST_CASE("a finite limit on locked memory locks what is there and never makes a later thread fail" *
          doctest::skip(!test::is_root() || own_allocator)) {
  const auto seen = json::parse(in_child({.nobody = true, .memlock_bytes = 8 << 20}, [] {
    std::string words;
    std::FILE* probe = ::popen(SETUP_PROBE, "r");
    for (int c = 0; (c = std::fgetc(probe)) != EOF;) words += static_cast<char>(c);
    return ::pclose(probe) == 0 ? words : "{}";
  }));
  CAPTURE(seen.dump(1));
  REQUIRE(seen.contains("got"));
  CHECK(seen["locked_kib"].get<long>() > 1000);
  CHECK(seen["ok"] == false);  // and it says that this is not all
  CHECK(seen["got"].get<std::string>().ends_with(", no later ones"));
  CHECK(seen["hint"].get<std::string>().starts_with("the limit is 8192 KiB: "));
  CHECK(seen["grown"] == true);
}

// pthread functions return their error; what errno holds is of some earlier call.
TEST_CASE("a refusal is told by what the call returned, whatever errno says" *
          doctest::skip(!test::is_root())) {
  const auto seen = json::parse(in_child({.nobody = true, .memlock_bytes = 0}, [] {
    errno = EXDEV;
    return as_json(set_up_control_thread({.cpu = 1000})).dump();
  }));
  CHECK(seen["scheduling"]["hint"].get<std::string>().starts_with("Operation not permitted; "));
  CHECK(seen["affinity"]["ok"] == false);
  CHECK(seen["affinity"]["wanted"] == "CPU 1000");
  CHECK(seen["affinity"]["hint"].get<std::string>().starts_with(
      "Invalid argument; this process may use CPU 0"));
  CHECK(seen["affinity"]["hint"].get<std::string>().ends_with(": correct [realtime] cpu"));
}

TEST_CASE("only the control thread is scheduled and pinned, not those before it, beside it or started by it" *
          doctest::skip(!test::is_root())) {
  const auto seen = json::parse(in_child({}, [] {
    json j;
    const RealtimeConfig config{.lock_memory = false, .cpu = 0};
    ControlThread control{config, [&] {
                            j["control"] = scheduling_of(gettid());
                            std::thread{[&] { j["its child"] = scheduling_of(gettid()); }}.join();
                          }};
    std::thread{[&] {
      j["beside"] = scheduling_of(gettid());
      j["beside, CPUs"] = status_of("Cpus_allowed_list");
      const auto row = check_ordinary_threads(control.id(), config);
      j["ok"] = row.ok;
      j["got"] = row.got;
    }}.join();
    j["main"] = scheduling_of(gettid());
    j["main, CPUs"] = status_of("Cpus_allowed_list");
    control.begin();
    control.join();
    return j.dump();
  }));
  CAPTURE(seen.dump(1));
  CHECK(seen["control"] == "1 60");
  CHECK(seen["its child"] == "0 0");
  CHECK(seen["beside"] == "0 0");
  CHECK(seen["main"] == "0 0");
  CHECK(seen["beside, CPUs"] == seen["main, CPUs"]);
  CHECK(seen["main, CPUs"] == status_of("Cpus_allowed_list"));
  CHECK(seen["ok"] == true);
  CHECK(seen["got"] == "2 of 2 threads");
}

TEST_CASE("a program that was started under chrt or taskset is found out" * doctest::skip(!test::is_root())) {
  const bool has_several = sysconf(_SC_NPROCESSORS_ONLN) > 1;
  const auto seen = json::parse(in_child({}, [] {
    const RealtimeConfig config{.lock_memory = false, .cpu = 0};
    json j;
    {
      cpu_set_t first;
      CPU_ZERO(&first);
      CPU_SET(0, &first);
      sched_setaffinity(0, sizeof first, &first);
      const ControlThread control{config, [] {}};
      j["pinned"] = check_ordinary_threads(control.id(), config).ok;
    }
    sched_param param{.sched_priority = 10};
    sched_setscheduler(0, SCHED_RR, &param);
    const RealtimeConfig anywhere{.lock_memory = false};
    const ControlThread control{anywhere, [] {}};
    j["chrt"] = check_ordinary_threads(control.id(), anywhere).got;
    return j.dump();
  }));
  CHECK(seen["pinned"] == !has_several);
  CHECK(seen["chrt"] == "0 of 1 threads");
}

TEST_CASE("what the configuration does not ask for is left as it is, and is not called real-time") {
  const auto seen = json::parse(in_child({}, [] {
    const RealtimeConfig nothing{
        .lock_memory = false, .heap_reserve_mib = 0, .priority = 0, .cpu = -1, .cpu_latency_us = -1};
    const ProcessSetup process{nothing, no_device};
    const ControlThread control{nothing, [] {}};
    json j = as_json(process.rows());
    j.update(as_json(control.setup()));
    j["complaints"] = complaints(process.rows()).size() + complaints(control.setup()).size();
    j["locked"] = std::stol(status_of("VmLck"));
    j["policy"] = scheduling_of(control.id());
    return j.dump();
  }));
  CHECK(seen["complaints"] == (own_allocator ? 1 : 0));
  CHECK(seen["locked"] == 0);
  CHECK(seen["policy"] == "0 0");
  for (const char* item : {"memory lock", "scheduling", "CPU latency"}) {
    CAPTURE(item);
    CHECK(seen[item]["ok"] == true);
    CHECK(seen[item]["real_time"] == false);
  }
  CHECK(seen["affinity"]["ok"] == true);
}

TEST_CASE(
    "after the set-up a deep call and a large allocation of the control thread meet no new page, locked or "
    "not" *
    doctest::skip(own_allocator)) {
  const auto seen = json::parse(in_child({}, [] {
    const RealtimeConfig config{
        .lock_memory = false, .heap_reserve_mib = 8, .priority = 0, .cpu_latency_us = -1};
    const ProcessSetup process{config, no_device};
    json j;
    ControlThread control{config, [&] {
                            // Rehearsed small: the code itself comes from its file page by page.
                            faults_of_a_deep_call(4096);
                            faults_of_an_allocation(4096);
                            const long deep = faults_of_a_deep_call(1 << 20);
                            j = {deep, faults_of_an_allocation(7 << 20)};
                          }};
    control.begin();
    control.join();
    return j.dump();
  }));
  CHECK(seen == json{0, 0});
}

TEST_CASE("a control thread that is never begun ends without its loop") {
  bool ran = false;
  {
    const ControlThread control{{.lock_memory = false, .priority = 0}, [&] { ran = true; }};
  }
  CHECK_FALSE(ran);
}

TEST_CASE("complaints are one line each: what, what there is, what was wanted, how to get it") {
  const SetupRows rows = {
      {.item = SetupItem::scheduling,
       .wanted = "SCHED_FIFO 60",
       .got = "SCHED_OTHER",
       .ok = false,
       .hint = "ask for it"},
      {.item = SetupItem::affinity, .wanted = "CPU 1", .got = "CPU 1", .ok = true, .hint = ""}};
  CHECK(complaints(rows) ==
        std::vector<std::string>{"scheduling: SCHED_OTHER, wanted SCHED_FIFO 60: ask for it"});
}
