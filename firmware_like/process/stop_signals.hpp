// What signals mean while a run goes on, from before the first file is made to after the last is written.
//
//   ctrl-C, ctrl-\, SIGTERM, SIGHUP (closed terminal, lost ssh),    stop: the arm stands, everything is saved. Again,
//   SIGPWR, SIGXCPU                                                 half a second later or more: the hard way, at once
//   ctrl-Z, SIGTTIN, SIGTTOU                                        nothing: a controller is not suspended while its
//                                                                   arm moves
//   SIGUSR1, timers, SIGIO, real-time signals                       nothing, though they would kill
//
// Wrappers such as timeout(1) send the same signal twice, and ctrl-C reaches a whole pipeline: signals within half a
// second are one. SIGHUP stays ignored where it was (nohup). SIGUSR2 is the flight recorder's (flight_files.hpp).
//
// Thread       constructed and destroyed on the first thread, one at a time; the handlers run wherever a signal comes,
//              on lock-free atomics alone
// Blocking     never
// Allocation   none
// Failure      none
#pragma once

#include "hal/base/clock.hpp"

#include <signal.h>
#include <utility>
#include <vector>

namespace moldloft::firmware_like {

// What a signal stops.
class Stoppable {
 public:
  // Ends what is going on and waits for nobody. From a signal's handler: lock-free atomics alone.
  virtual void stop_for_good() noexcept = 0;

 protected:
  ~Stoppable() = default;
};

class StopSignals {
 public:
  static constexpr hal::Duration one_wish = std::chrono::milliseconds{500};

  StopSignals();
  ~StopSignals();  // signals mean again what they meant before
  StopSignals(const StopSignals&) = delete;
  StopSignals& operator=(const StopSignals&) = delete;

  // What the next signal stops, or what is stopped now if one has come already. Null: nothing any more.
  void stops(Stoppable*) noexcept;

  static bool asked() noexcept;                 // to stop
  static bool suspension_was_asked() noexcept;  // by ctrl-Z; true once for each

 private:
  std::vector<std::pair<int, struct sigaction>> before_;
};

}  // namespace moldloft::firmware_like
