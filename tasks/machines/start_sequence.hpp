// Before the first shot: both devices connect, the scanner is checked, and the arm calibrated unless it knows
// where it stands.
#pragma once

#include "hal/base/realtime.hpp"
#include "hal/base/transition.hpp"

#include <cstdint>
#include <span>
#include <string_view>

namespace moldloft::tasks {

enum class StartState : std::uint8_t {
  off,
  connecting,
  calibrating,
  ready,
  given_up,
};
constexpr int start_state_count = 5;

enum class StartEvent : std::uint8_t {
  begin,
  both_ready,  // scanner and robot, in this tick
  missing,     // one of them is not ready, and the arm does not calibrate
};
constexpr int start_event_count = 3;

enum class StartAction : std::uint8_t {
  none,
  connect,
  calibrate,
  go_on,
  refuse_scanner,
  give_up,
};

struct StartContext {
  bool misfit = false;      // the scanner is not the configured one
  bool calibrated = false;  // the arm knows where it stands
  bool timed_out = false;   // one of them has been missing for too long
};

using StartTransition = hal::Transition<StartState, StartEvent, StartAction, StartContext>;
std::span<const StartTransition> start_transitions() MOLDLOFT_NONBLOCKING;
std::span<const hal::Ignored<StartState, StartEvent>> start_ignored();

std::string_view to_string(StartState) MOLDLOFT_NONBLOCKING;
std::string_view to_string(StartEvent) MOLDLOFT_NONBLOCKING;
std::string_view to_string(StartAction);

}  // namespace moldloft::tasks
