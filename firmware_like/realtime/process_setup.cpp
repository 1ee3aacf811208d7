#include "firmware_like/realtime/process_setup.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <fcntl.h>
#include <filesystem>
#include <fstream>
#include <malloc.h>
#include <optional>
#include <pthread.h>
#include <sched.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <unistd.h>

namespace moldloft::firmware_like {
namespace {

constexpr std::size_t mebibyte = 1 << 20;

// The deepest calls of the control thread need some ten KiB; the default of 8 MiB, locked for each thread, would hold
// more memory than the rest of the program.
constexpr std::size_t thread_stack_bytes = 2 * mebibyte;

// Left alone at the far end of the stack when it is touched: the guard page and the frames of the touching itself.
constexpr std::size_t untouched_stack_bytes = 128 * 1024;
static_assert(untouched_stack_bytes < thread_stack_bytes);

// Pages that the kernel maps into every process itself (vdso) are resident and never locked.
constexpr long unlockable_kib = 64;

std::string error_text(int code) { return std::strerror(code); }

std::string first_line_with(const char* path, std::string_view key) {
  std::ifstream file{path};
  for (std::string line; std::getline(file, line);) {
    if (line.starts_with(key)) return line.substr(key.size());
  }
  return {};
}

long status_kib(std::string_view key) {
  const std::string value = first_line_with("/proc/self/status", key);
  return value.empty() ? -1 : std::atol(value.c_str());
}

// CAP_IPC_LOCK: locks as much as it likes, whatever the limit says.
bool may_lock_anything() {
  constexpr unsigned ipc_lock = 14;
  const std::string value = first_line_with("/proc/self/status", "CapEff:");
  return (std::strtoull(value.c_str(), nullptr, 16) >> ipc_lock & 1) != 0;
}

long minor_faults() {
  rusage usage{};
  getrusage(RUSAGE_THREAD, &usage);
  return usage.ru_minflt;
}

// volatile: a compiler sees that nobody reads what is written here, and would leave it out.
void touch(volatile char* memory, std::size_t bytes) {
  static const auto page = static_cast<std::size_t>(sysconf(_SC_PAGESIZE));
  for (std::size_t i = 0; i < bytes; i += page) memory[i] = 0;
  if (bytes > 0) memory[bytes - 1] = 0;
}

SetupRow keep_freed_memory() {
  // mallopt returns 1 when it has done what it was asked; it does not set errno.
  const bool no_trim = mallopt(M_TRIM_THRESHOLD, -1) == 1;
  const bool no_map = mallopt(M_MMAP_MAX, 0) == 1;
  SetupRow row{.item = SetupItem::allocator, .wanted = "no trim, no mmap", .got = "", .hint = ""};
  row.ok = row.real_time = no_trim && no_map;
  row.got =
      row.ok ? row.wanted : fmt::format("{}, {}", no_trim ? "no trim" : "trim", no_map ? "no mmap" : "mmap");
  if (!row.ok) row.hint = "the C library in use does not take mallopt; nothing helps but another one";
  return row;
}

// With a finite limit the pages of the future must not be locked. The call succeeds while there is room, and
// later some harmless allocation or thread fails.
SetupRow lock_memory(bool wanted, bool& locked) {
  SetupRow row{.item = SetupItem::memory_lock,
               .wanted = wanted ? "all pages, now and later" : "no",
               .got = "",
               .hint = ""};
  if (!wanted) {
    row.got = "no";
    row.ok = true;
    return row;
  }
  rlimit limit{};
  getrlimit(RLIMIT_MEMLOCK, &limit);
  const bool unlimited = limit.rlim_cur == RLIM_INFINITY || may_lock_anything();
  const int failed = mlockall(unlimited ? MCL_CURRENT | MCL_FUTURE : MCL_CURRENT) == 0 ? 0 : errno;
  locked = failed == 0;
  const long kib = status_kib("VmLck:"), resident_kib = status_kib("VmRSS:");
  const bool all_now = kib > 0 && kib + unlockable_kib >= resident_kib;
  row.ok = row.real_time = locked && unlimited && all_now;
  row.got = fmt::format("{} KiB locked, {} KiB resident", kib, resident_kib);
  if (row.ok) return row;
  row.got += failed != 0 ? fmt::format(" ({})", error_text(failed)) : unlimited ? "" : ", no later ones";
  row.hint =
      unlimited
          ? "the kernel or a sanitizer ignores mlockall"
          : fmt::format(
                "the limit is {} KiB: LimitMEMLOCK=infinity in the service unit, or memlock unlimited in "
                "/etc/security/limits.d",
                limit.rlim_cur / 1024);
  return row;
}

SetupRow size_thread_stacks() {
  pthread_attr_t attributes;
  pthread_attr_init(&attributes);
  int failed = pthread_attr_setstacksize(&attributes, thread_stack_bytes);
  if (failed == 0) failed = pthread_setattr_default_np(&attributes);
  std::size_t bytes = 0;
  pthread_getattr_default_np(&attributes);
  pthread_attr_getstacksize(&attributes, &bytes);
  pthread_attr_destroy(&attributes);
  SetupRow row{.item = SetupItem::thread_stacks,
               .wanted = fmt::format("{} KiB", thread_stack_bytes / 1024),
               .got = fmt::format("{} KiB", bytes / 1024),
               .hint = ""};
  row.ok = row.real_time = failed == 0 && bytes == thread_stack_bytes;
  if (!row.ok) row.hint = failed != 0 ? error_text(failed) : "the C library has not taken it";
  return row;
}

// How much of the stack lies below the caller's frame, without what is left alone.
std::size_t stack_left() {
  pthread_attr_t attributes;
  void* lowest = nullptr;
  std::size_t bytes = 0;
  if (pthread_getattr_np(pthread_self(), &attributes) != 0) return 0;
  pthread_attr_getstack(&attributes, &lowest, &bytes);
  pthread_attr_destroy(&attributes);
  const auto here = reinterpret_cast<std::uintptr_t>(__builtin_frame_address(0));
  const auto left = here - reinterpret_cast<std::uintptr_t>(lowest);
  // The first thread's stack may grow without limit: as much as the other threads have is plenty.
  return std::min(left, thread_stack_bytes) - std::min(left, untouched_stack_bytes);
}

// Touches so much of the stack twice; returns how many pages were met for the first time the second time.
[[gnu::noinline]] long touch_stack(std::size_t bytes) {
  auto* stack = static_cast<volatile char*>(__builtin_alloca(bytes));
  touch(stack, bytes);
  const long before = minor_faults();
  touch(stack, bytes);
  return minor_faults() - before;
}

SetupRow touch_control_stack() {
  const std::size_t bytes = stack_left();
  const long faults = bytes > 0 ? touch_stack(bytes) : -1;
  SetupRow row{.item = SetupItem::control_stack,
               .wanted = "touched, 0 faults when touched again",
               .got = fmt::format("{} KiB touched, {} faults", bytes / 1024, faults),
               .hint = ""};
  row.ok = row.real_time = faults == 0;
  if (!row.ok)
    row.hint =
        bytes == 0 ? "the thread's stack is too small" : "memory is short: pages were taken away at once";
  return row;
}

// Allocated, touched and given back: the allocator keeps it (keep_freed_memory), so that what is allocated afterwards,
// when a serial port is opened again, finds its pages there.
SetupRow touch_heap_reserve(int mebibytes) {
  const std::size_t bytes = static_cast<std::size_t>(mebibytes) * mebibyte;
  SetupRow row{.item = SetupItem::heap_reserve,
               .wanted = fmt::format("{} MiB, 0 faults when used again", mebibytes),
               .got = "",
               .hint = ""};
  long faults = 0;
  for (int pass = 0; pass < 2 && bytes > 0; ++pass) {
    void* reserve = std::malloc(bytes);
    if (reserve == nullptr) {
      row.got = "not allocated";
      row.hint = "memory is short: lower [realtime] heap_reserve_mib, or the largest plate";
      return row;
    }
    const long before = minor_faults();
    touch(static_cast<char*>(reserve), bytes);
    faults = minor_faults() - before;
    std::free(reserve);
  }
  row.got = fmt::format("{} MiB, {} faults", mebibytes, faults);
  row.ok = row.real_time = faults == 0;
  if (!row.ok) row.hint = "the allocator gives memory back: it does not take mallopt";
  return row;
}

std::string policy_name(int policy, int priority) {
  switch (policy & ~SCHED_RESET_ON_FORK) {
    case SCHED_OTHER:
      return "SCHED_OTHER";
    case SCHED_FIFO:
      return fmt::format("SCHED_FIFO {}", priority);
    case SCHED_RR:
      return fmt::format("SCHED_RR {}", priority);
    default:
      return fmt::format("policy {}", policy);
  }
}

SetupRow schedule(int priority) {
  SetupRow row{.item = SetupItem::scheduling,
               .wanted = policy_name(priority > 0 ? SCHED_FIFO : SCHED_OTHER, priority),
               .got = "",
               .hint = ""};
  sched_param param{};
  param.sched_priority = priority;
  // Reset on fork: a thread that some library starts from the control thread is an ordinary one.
  const int failed =
      priority > 0 ? pthread_setschedparam(pthread_self(), SCHED_FIFO | SCHED_RESET_ON_FORK, &param) : 0;
  // The kernel's own answer: pthread_getschedparam repeats what it remembers of the last call.
  const int policy = sched_getscheduler(0);
  sched_getparam(0, &param);
  row.got = policy_name(policy, param.sched_priority);
  row.ok = row.got == row.wanted;
  row.real_time = (policy & ~SCHED_RESET_ON_FORK) == SCHED_FIFO;
  if (row.ok) return row;
  rlimit limit{};
  getrlimit(RLIMIT_RTPRIO, &limit);
  row.hint = fmt::format(
      "{}; the limit is {}: LimitRTPRIO={} in the service unit, or rtprio {} in /etc/security/limits.d",
      failed != 0 ? error_text(failed) : "the kernel has not taken it", limit.rlim_cur, priority, priority);
  return row;
}

// "0-3,6"
std::string cpu_list(const cpu_set_t& cpus) {
  std::string list;
  for (int first = 0; first < CPU_SETSIZE; ++first) {
    if (!CPU_ISSET(first, &cpus)) continue;
    int last = first;
    while (last + 1 < CPU_SETSIZE && CPU_ISSET(last + 1, &cpus)) ++last;
    list += fmt::format("{}{}", list.empty() ? "" : ",", first);
    if (last > first) list += fmt::format("-{}", last);
    first = last;
  }
  return list;
}

std::string allowed_cpus(pid_t thread) {
  cpu_set_t cpus;
  CPU_ZERO(&cpus);
  return sched_getaffinity(thread, sizeof cpus, &cpus) == 0 ? cpu_list(cpus) : "unknown";
}

SetupRow pin(int cpu) {
  SetupRow row{.item = SetupItem::affinity,
               .wanted = cpu < 0 ? "any CPU" : fmt::format("CPU {}", cpu),
               .got = "",
               .hint = ""};
  const std::string before = allowed_cpus(0);
  int failed = 0;
  if (cpu >= 0) {
    cpu_set_t cpus;
    CPU_ZERO(&cpus);
    CPU_SET(static_cast<std::size_t>(cpu), &cpus);
    failed = pthread_setaffinity_np(pthread_self(), sizeof cpus, &cpus);
  }
  const std::string now = allowed_cpus(0);
  row.got = "CPU " + now;
  row.real_time = row.got == row.wanted;
  row.ok = cpu < 0 || row.real_time;
  if (!row.ok) {
    row.hint = fmt::format("{}; this process may use CPU {}: correct [realtime] cpu",
                           failed != 0 ? error_text(failed) : "the kernel has not taken it", before);
  }
  return row;
}

}  // namespace

std::string_view to_string(SetupItem item) {
  constexpr std::array<std::string_view, 9> names = {"allocator",   "memory lock",   "thread stacks",
                                                     "CPU latency", "control stack", "heap reserve",
                                                     "scheduling",  "affinity",      "ordinary threads"};
  return names[static_cast<std::size_t>(item)];
}

ProcessSetup::ProcessSetup(const RealtimeConfig& config, const std::string& latency_device) {
  rows_.push_back(keep_freed_memory());
  rows_.push_back(size_thread_stacks());
  rows_.push_back(lock_memory(config.lock_memory, locked_));
  rows_.push_back(request_latency(config.cpu_latency_us, latency_device));
}

ProcessSetup::~ProcessSetup() {
  if (latency_ >= 0) ::close(latency_);
  if (locked_) munlockall();
}

// The kernel takes the request as a binary 32-bit number, keeps it while the file is open, and answers with the
// smallest of all that are being held.
SetupRow ProcessSetup::request_latency(int wanted_us, const std::string& device) {
  SetupRow row{.item = SetupItem::cpu_latency,
               .wanted = wanted_us < 0 ? "as the machine likes" : fmt::format("{} us at most", wanted_us),
               .got = "as the machine likes",
               .hint = ""};
  if (wanted_us < 0) {
    row.ok = true;
    return row;
  }
  int failed = 0;
  latency_ = ::open(device.c_str(), O_RDWR | O_CLOEXEC);
  if (latency_ < 0) failed = errno;
  const std::int32_t request = wanted_us;
  if (failed == 0 && ::write(latency_, &request, sizeof request) != sizeof request) failed = errno;
  std::int32_t now_us = -1;
  if (failed == 0 && ::pread(latency_, &now_us, sizeof now_us, 0) != sizeof now_us) failed = errno;
  if (failed == 0) row.got = fmt::format("{} us at most", now_us);
  row.ok = row.real_time = failed == 0 && now_us >= 0 && now_us <= wanted_us;
  if (!row.ok) {
    row.hint =
        fmt::format("{}: {}; give the program's user write access to it (the package's udev rule does)",
                    device, failed != 0 ? error_text(failed) : "the request was not taken");
  }
  return row;
}

SetupRows set_up_control_thread(const RealtimeConfig& config) {
  // Priority last: what comes before it may take long, and other threads must get their turn meanwhile.
  return {touch_control_stack(), touch_heap_reserve(config.heap_reserve_mib), pin(config.cpu),
          schedule(config.priority)};
}

SetupRow check_ordinary_threads(pid_t control_thread, const RealtimeConfig& config) {
  SetupRow row{.item = SetupItem::ordinary_threads,
               .wanted = "SCHED_OTHER, not on the control thread's CPU alone",
               .got = "",
               .hint = ""};
  int count = 0, wrong = 0;
  std::error_code failed;
  for (const auto& entry : std::filesystem::directory_iterator{"/proc/self/task", failed}) {
    const auto thread = static_cast<pid_t>(std::atol(entry.path().filename().c_str()));
    if (thread == control_thread) continue;
    ++count;
    const int policy = sched_getscheduler(thread);
    const bool pinned = config.cpu >= 0 && sysconf(_SC_NPROCESSORS_ONLN) > 1 &&
                        allowed_cpus(thread) == fmt::format("{}", config.cpu) &&
                        allowed_cpus(control_thread) == fmt::format("{}", config.cpu);
    if ((policy & ~SCHED_RESET_ON_FORK) != SCHED_OTHER || pinned) ++wrong;
  }
  row.got = fmt::format("{} of {} threads", count - wrong, count);
  row.ok = row.real_time = wrong == 0 && count > 0;
  if (!row.ok) row.hint = "start the program without chrt and taskset: it sets up its control thread itself";
  return row;
}

std::vector<std::string> complaints(const SetupRows& rows) {
  std::vector<std::string> lines;
  for (const auto& row : rows) {
    if (!row.ok)
      lines.push_back(
          fmt::format("{}: {}, wanted {}: {}", to_string(row.item), row.got, row.wanted, row.hint));
  }
  return lines;
}

}  // namespace moldloft::firmware_like
