// What the service manager is told (sd_notify): ready, a line of status, stopping, and that the program lives. Where no
// service manager listens, nothing is sent.
//
// Thread       ordinary threads only, one at a time: it writes to a socket, which the control thread never waits for
// Blocking     no: the manager's socket takes a datagram or the message is lost
// Allocation   yes
// Failure      none: a program that its manager does not hear is the manager's to restart
#pragma once

#include "hal/base/clock.hpp"

#include <string_view>

namespace moldloft::firmware_like {

class ServiceNotify {
 public:
  ServiceNotify();  // reads what the manager has put into the environment

  // Within this time from one feed() to the next the manager believes that the program lives; 0: it does not ask.
  hal::Duration watchdog() const { return watchdog_; }

  void ready(std::string_view status);
  void status(std::string_view status);
  void stopping(std::string_view status);
  void feed();

 private:
  hal::Duration watchdog_{0};
};

}  // namespace moldloft::firmware_like
