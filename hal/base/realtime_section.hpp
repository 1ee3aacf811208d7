// Where the control thread keeps its promise. Between begin() and end() it does not wait except in the
// clock's own sleep, does not lock, and does not touch the heap. The mark does nothing by itself; guards
// read it. A library that is preloaded into the deployed program (tests/realtime) finds it by its name among
// the program's symbols.
//
// Thread       each has a mark of its own
// Cost         begin() and end(): one store
// Allocation   none
#pragma once

#include "hal/base/realtime.hpp"

// In C, so that its name is the same to everybody; constant-initialised, so that reading it calls nothing.
extern "C" constinit thread_local int moldloft_realtime_section;

namespace moldloft::hal {

class RealtimeSection {
 public:
  static void begin() noexcept { moldloft_realtime_section = 1; }
  static void end() noexcept { moldloft_realtime_section = 0; }
  static bool inside() noexcept { return moldloft_realtime_section != 0; }
};

// While one lives, the promise is suspended: for closing a link that was lost and opening it again.
// libserialport allocates there and reads sysfs, Asio locks its reactor, and neither can be told not to. The
// driver has reported the loss, so the cell holds or aborts. A run says how often that was (suspensions()): a
// clean count cannot hide it.
class PromiseSuspended {
 public:
  PromiseSuspended() noexcept MOLDLOFT_NONBLOCKING;
  ~PromiseSuspended() noexcept MOLDLOFT_NONBLOCKING;
  PromiseSuspended(const PromiseSuspended&) = delete;
  PromiseSuspended& operator=(const PromiseSuspended&) = delete;

  static int suspensions() noexcept;  // of this thread, inside its section

 private:
  int before_;
};

}  // namespace moldloft::hal
