// [realtime] of the cell's configuration: what the control thread asks of the operating system. It changes
// when things are measured, never what.
#pragma once

namespace moldloft::firmware_like {

struct RealtimeConfig {
  bool lock_memory = true;
  int heap_reserve_mib = 16;  // touched at the start, so that what is allocated later is there already
  // SCHED_FIFO of the control thread; 0: ordinary scheduling. Above the interrupt threads: PREEMPT_RT runs
  // them at 50, and a thread of the same priority waits for them. Far below the kernel's own threads at 99,
  // which must get their turn.
  int priority = 60;
  int cpu = -1;            // the control thread's alone; -1: any
  int cpu_latency_us = 0;  // what waking from an idle state may cost at most; -1: as the machine likes
};

}  // namespace moldloft::firmware_like
