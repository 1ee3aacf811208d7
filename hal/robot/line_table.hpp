// The way through a line robot's connection and command, as a table (PROTOCOLS.md has the words).
#pragma once

#include "hal/base/transition.hpp"

#include <cstdint>
#include <span>
#include <string_view>

namespace moldloft::hal {

enum class LinePhase : std::uint8_t {
  offline,
  syncing,
  checking,
  locating,
  ready,
  commanded,
  moving,
  faulted,
};
constexpr int line_phase_count = 8;

enum class LineCue : std::uint8_t {
  link_open,
  link_lost,
  silent,
  synced,
  in_motion,
  stands_still,
  located,
  command,
  acked,
  done,
  error,
  late,
  fault,
  reset,
};
constexpr int line_cue_count = 14;

enum class LineAction : std::uint8_t {
  none,
  report_loss,
  report_silence,
  start_sync,
  send_syn,
  ask_status,
  send_stop,
  ask_pose,
  announce,
  send_command,
  resend_command,
  resend_afresh,
  report_moving,
  await_done,
  report_done,
  report_refused,
  report_stopped_and_sync,
  report_fault,
  unlatch,
};
constexpr int line_action_count = 19;

struct LineContext {
  bool latched = false;      // a fault that no operator has cleared yet
  bool stopping = false;     // stop() was called since the command was sent
  bool stop_known = false;   // ... and the robot has answered it
  bool has_resends = false;  // the line may go once more before the robot is asked how it stands
};

using LineTransition = Transition<LinePhase, LineCue, LineAction, LineContext>;
std::span<const LineTransition> line_transitions() MOLDLOFT_NONBLOCKING;
std::span<const Ignored<LinePhase, LineCue>> line_ignored();

std::string_view to_string(LinePhase);
std::string_view to_string(LineCue);
std::string_view to_string(LineAction);

}  // namespace moldloft::hal
