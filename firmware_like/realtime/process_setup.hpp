// What the control thread needs of the operating system to keep its deadlines: asked for once, read back from
// the kernel, reported as rows. No setting is required. Of a setting that the system refuses, a row says so
// and how to get it, and the run goes on.
//
// Thread       ProcessSetup: before the threads are started. set_up_control_thread(): on the control thread itself, and
//              no other thread gets anything of it
// Blocking     yes; set-up time only
// Allocation   yes; it touches the heap's reserve on purpose
// Failure      none; see the rows
#pragma once

#include "firmware_like/config/realtime_config.hpp"

#include <string>
#include <string_view>
#include <sys/types.h>
#include <vector>

namespace moldloft::firmware_like {

enum class SetupItem {
  allocator,         // freed memory stays with the process, large blocks come from the heap too
  memory_lock,       // no page of the process is ever taken away
  thread_stacks,     // of a stated size: locked memory holds all of a stack, used or not
  cpu_latency,       // processors do not sleep deeper than this
  control_stack,     // touched, so that no call meets a page for the first time
  heap_reserve,      // likewise
  scheduling,        // FIFO, of the control thread alone
  affinity,          // the control thread's processor
  ordinary_threads,  // none of the others has taken over scheduling or processor
};
std::string_view to_string(SetupItem);

struct SetupRow {
  SetupItem item;
  std::string wanted, got;
  bool ok = false;         // got what was wanted
  bool real_time = false;  // got what real time needs, wanted or not
  std::string hint;        // how to get it; empty when all is well
};
using SetupRows = std::vector<SetupRow>;

inline constexpr const char* cpu_latency_device = "/dev/cpu_dma_latency";

// Everything that is the process's. Construct it when the large things are allocated, before the threads; memory stays
// locked and the latency request holds for the object's life.
class ProcessSetup {
 public:
  explicit ProcessSetup(const RealtimeConfig&, const std::string& latency_device = cpu_latency_device);
  ~ProcessSetup();
  ProcessSetup(const ProcessSetup&) = delete;
  ProcessSetup& operator=(const ProcessSetup&) = delete;

  const SetupRows& rows() const { return rows_; }

 private:
  SetupRow request_latency(int wanted_us, const std::string& device);

  SetupRows rows_;
  bool locked_ = false;
  int latency_ = -1;  // the request holds as long as this file is open
};

// Everything that is the control thread's.
SetupRows set_up_control_thread(const RealtimeConfig&);

// Looks at all other threads of the process as they are now.
SetupRow check_ordinary_threads(pid_t control_thread, const RealtimeConfig&);

// What was not had, one line each, for a person: "memory lock: current pages, wanted all pages: ...".
std::vector<std::string> complaints(const SetupRows&);

}  // namespace moldloft::firmware_like
