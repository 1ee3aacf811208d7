// Messages to the service manager (sd_notify): ready, a line of status, stopping, and that the program lives.
// Nothing is sent when no service manager listens.
//
// Thread       ordinary threads only, one at a time: it writes to a socket, which the control thread never waits for
// Blocking     no: the manager's socket takes a datagram or the message is lost
// Allocation   yes
// Failure      none: a manager that hears nothing restarts the program
#pragma once

#include "hal/base/clock.hpp"

#include <string_view>

namespace moldloft::firmware_like {

class ServiceNotify {
 public:
  ServiceNotify();  // reads what the manager has put into the environment

  // The longest time between two feed()s after which the manager still takes the program for alive; 0: it
  // does not ask.
  hal::Duration watchdog() const { return watchdog_; }

  void ready(std::string_view status);
  void status(std::string_view status);
  void stopping(std::string_view status);
  void feed();

 private:
  hal::Duration watchdog_{0};
};

}  // namespace moldloft::firmware_like
