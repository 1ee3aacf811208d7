// Waits for the disk: no shot is taken while the records of those before are still on their way to it. A slow
// disk costs moments. When the disk is full or hangs, the cell holds and says so.
//
// Thread       the control thread
// Blocking     never
// Allocation   none
// Failure      a disk that takes nothing for `disk_wait` leaves the hold to a person
#pragma once

#include "hal/base/realtime.hpp"
#include "hal/record/recorder.hpp"
#include "tasks/cell/cell_settings.hpp"
#include "tasks/cell/supervisor.hpp"

namespace moldloft::tasks {

class DiskWait {
 public:
  DiskWait(const CellSettings& settings, Supervisor& supervisor, const hal::Recorder& recorder)
      : settings_{settings}, supervisor_{supervisor}, recorder_{recorder} {}

  void hold_without_room() MOLDLOFT_NONBLOCKING;  // once a tick in which a shot is due and not taken
  void step_held() MOLDLOFT_NONBLOCKING;          // once a tick in which the disk holds the cell

 private:
  const CellSettings& settings_;
  Supervisor& supervisor_;
  const hal::Recorder& recorder_;
  hal::Instant no_room_since_ = hal::Instant::max();
};

}  // namespace moldloft::tasks
