// What follows what inside Execute, as one table: the edge is sought, the boundary tracked, the zig-zag planned, the
// surface scanned, the fit finished.
//
// A flaw, or a plate that outgrows the memory plan, leaves the phase as it is: the cell holds.
#pragma once

#include "hal/base/realtime.hpp"
#include "hal/base/transition.hpp"

#include <cstdint>
#include <span>
#include <string_view>

namespace moldloft::tasks {

enum class Phase : std::uint8_t {
  none,  // outside Execute, or nothing is left to do in it
  seek_edge,
  track_boundary,
  plan_scan,
  scan_surface,
  finish_fit,
};
constexpr int phase_count = 6;

enum class PhaseEvent : std::uint8_t {
  begin,        // Execute is entered for the first time in a run
  edge_found,   // the tracker is on the plate's edge
  loop_closed,  // the tracker has been once round the plate
  outline_ready,
  zigzag_ready,
  all_taken,  // every shot of the zig-zag is folded in
  surface_ready,
  flaw,    // the background work cannot go on
  forget,  // the run is over
};
constexpr int phase_event_count = 9;

enum class PhaseAction : std::uint8_t {
  none,
  seek,
  note_edge,
  build_outline,
  plan_zigzag,
  scan,
  solve,
  finish,
  report_too_many_shots,
  report_too_large,
  report_flaw,
};

struct PhaseContext {
  bool beyond_plan = false;  // what the event tells of outgrows the memory plan
};

using PhaseTransition = hal::Transition<Phase, PhaseEvent, PhaseAction, PhaseContext>;
std::span<const PhaseTransition> phase_transitions() MOLDLOFT_NONBLOCKING;
std::span<const hal::Ignored<Phase, PhaseEvent>> phase_ignored();

std::string_view to_string(Phase) MOLDLOFT_NONBLOCKING;  // empty for none
std::string_view to_string(PhaseEvent);
std::string_view to_string(PhaseAction);

}  // namespace moldloft::tasks
