// The tables are complete: every pair of state and event is listed or explicitly ignored, never both, and
// every state can be reached.
#include "hal/complete_table.hpp"
#include "tasks/machines/boundary_tracker.hpp"
#include "tasks/machines/cell_state.hpp"
#include "tasks/machines/phases.hpp"
#include "tasks/machines/shot_sequence.hpp"
#include "tasks/machines/start_sequence.hpp"

#include <doctest/doctest.h>

#include <set>

using namespace moldloft::tasks;
using namespace moldloft::hal;

TEST_CASE("the supervisor's table answers every event in every state") {
  check_complete(cell_transitions(), cell_ignored(), cell_state_count, cell_event_count);
  check_reachable(cell_transitions(), cell_state_count);
}

TEST_CASE("the shot sequence's table answers every event in every state") {
  check_complete(shot_transitions(), shot_ignored(), shot_state_count, shot_event_count);
  check_reachable(shot_transitions(), shot_state_count);
}

TEST_CASE(
    "the phases' table answers every event in every phase, whether or not the memory plan is outgrown") {
  check_complete(phase_transitions(), phase_ignored(), phase_count, phase_event_count);
  check_reachable(phase_transitions(), phase_count);
  check_no_fall_through(phase_transitions(), PhaseContext{});
}

TEST_CASE("only a zig-zag with room for its shots is scanned, and no phase is left over a flaw") {
  const auto after = [](Phase phase, PhaseEvent event, bool beyond_plan) {
    return find_transition(phase_transitions(), phase, event, PhaseContext{.beyond_plan = beyond_plan});
  };
  CHECK(after(Phase::plan_scan, PhaseEvent::zigzag_ready, false)->to == Phase::scan_surface);
  CHECK(after(Phase::plan_scan, PhaseEvent::zigzag_ready, true)->to == Phase::plan_scan);
  for (const Phase phase : {Phase::plan_scan, Phase::scan_surface, Phase::finish_fit}) {
    for (const bool beyond_plan : {false, true}) {
      const auto* row = after(phase, PhaseEvent::flaw, beyond_plan);
      REQUIRE(row != nullptr);
      CHECK(row->to == phase);
      CHECK(row->action == (beyond_plan ? PhaseAction::report_too_large : PhaseAction::report_flaw));
    }
  }
}

TEST_CASE("the start sequence's table answers every event in every state, whatever the devices say") {
  check_complete(start_transitions(), start_ignored(), start_state_count, start_event_count);
  check_reachable(start_transitions(), start_state_count);
  check_no_fall_through(start_transitions(), StartContext{});
}

TEST_CASE("the tracker's table answers every event in every state, whatever its counters say") {
  check_complete(track_transitions(), track_ignored(), track_state_count, track_event_count);
  check_reachable(track_transitions(), track_state_count);
  check_no_fall_through(track_transitions(), TrackContext{});  // all counters at their limits
}

TEST_CASE("abort is taken from every state but those that have aborted already") {
  for (int s = 0; s < cell_state_count; ++s) {
    const auto state = static_cast<CellState>(s);
    const bool aborted = state == CellState::aborting || state == CellState::aborted;
    CHECK((find_transition(cell_transitions(), state, CellEvent::abort, CellContext{}) == nullptr) ==
          aborted);
  }
}

// Every state that any order of events can lead to, without those of `never`.
std::set<CellState> reachable_without(CellState from, CellContext context, std::set<CellEvent> never) {
  std::set<CellState> reached{from};
  for (std::size_t before = 0; before != reached.size();) {
    before = reached.size();
    for (const CellState state : std::set{reached}) {
      for (int e = 0; e < cell_event_count; ++e) {
        const auto event = static_cast<CellEvent>(e);
        const auto* row =
            never.contains(event) ? nullptr : find_transition(cell_transitions(), state, event, context);
        if (row != nullptr) reached.insert(row->to);
      }
    }
  }
  return reached;
}

TEST_CASE("a cell that starts held moves in no order of events that lacks an operator's unhold and start") {
  const auto* row =
      find_transition(cell_transitions(), CellState::idle, CellEvent::start_held, CellContext{});
  REQUIRE(row != nullptr);
  CHECK(row->to == CellState::held);
  CHECK(row->action == CellAction::wait_for_operator);
  const auto reached = reachable_without(row->to, {.begun = false}, {CellEvent::unhold, CellEvent::start});
  for (const auto moving :
       {CellState::starting, CellState::execute, CellState::unholding, CellState::completing})
    CHECK_FALSE(reached.contains(moving));
  CHECK(reached.contains(CellState::stopped));
  CHECK(reached.contains(CellState::aborted));
}

TEST_CASE("unhold begins a cell that was started held, and takes up again one that has begun") {
  const auto after = [](bool begun) {
    return find_transition(cell_transitions(), CellState::held, CellEvent::unhold,
                           CellContext{.begun = begun})
        ->to;
  };
  CHECK(after(false) == CellState::starting);
  CHECK(after(true) == CellState::unholding);
}
