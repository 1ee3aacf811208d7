// The control thread's loop on real devices: ticks from the start to the cell's rest. The first ticks open
// links and touch pages. After them the loop runs in a RealtimeSection, and what the operating system does to
// the thread is counted.
//
// Thread       the control thread
// Blocking     as Controller::tick() says
// Allocation   in the first ticks only, or where a lost link is opened again
#pragma once

#include "firmware_like/controller/controller.hpp"
#include "firmware_like/realtime/thread_counts.hpp"

namespace moldloft::firmware_like {

ThreadCounts run_to_rest(Controller&);

}  // namespace moldloft::firmware_like
