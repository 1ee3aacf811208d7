// The drivers' tables are complete, whatever their context says, and hold what hal/README.md promises of them.
#include "hal/complete_table.hpp"
#include "hal/robot/line_table.hpp"
#include "hal/scanner/psc_table.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <initializer_list>
#include <set>
#include <vector>

using namespace moldloft::hal;

namespace {

// Every context that four answers of yes or no can make.
template <typename Context>
std::vector<Context> all_contexts() {
  std::vector<Context> all;
  for (int bits = 0; bits < 16; ++bits)
    all.push_back({(bits & 1) != 0, (bits & 2) != 0, (bits & 4) != 0, (bits & 8) != 0});
  return all;
}

// In every context some row of a listed pair is taken, and every row is the one taken in some context.
template <typename Context, typename Table>
void check_rows_are_taken(Table table) {
  std::set<std::ptrdiff_t> taken;
  for (const auto& row : table) {
    for (const auto& context : all_contexts<Context>()) {
      const auto* found = find_transition(table, row.from, row.on, context);
      CHECK_MESSAGE(found != nullptr, to_string(row.from), " / ", to_string(row.on), " falls through");
      if (found != nullptr) taken.insert(found - table.data());
    }
  }
  for (std::size_t i = 0; i < table.size(); ++i) {
    CHECK_MESSAGE(taken.contains(static_cast<std::ptrdiff_t>(i)), to_string(table[i].from), " / ",
                  to_string(table[i].on), " [", table[i].guard.name, "] is never taken");
  }
}

// Every state that any order of cues can lead to, without those of `never`, while the context stays as it is.
template <typename State, typename Cue, typename Table, typename Context>
std::set<State> reachable(Table table, State from, const Context& context, std::set<Cue> never, int cues) {
  std::set<State> reached{from};
  for (std::size_t before = 0; before != reached.size();) {
    before = reached.size();
    for (const State state : std::set{reached}) {
      for (int c = 0; c < cues; ++c) {
        const auto cue = static_cast<Cue>(c);
        const auto* row = never.contains(cue) ? nullptr : find_transition(table, state, cue, context);
        if (row != nullptr) reached.insert(row->to);
      }
    }
  }
  return reached;
}

// A name for every value, and none of them twice.
template <typename Value>
void check_names(int count) {
  std::set<std::string_view> names;
  for (int i = 0; i < count; ++i) names.insert(to_string(static_cast<Value>(i)));
  CHECK(names.size() == static_cast<std::size_t>(count));
  CHECK_FALSE(names.contains(""));
}

}  // namespace

TEST_CASE("the PSC1 scanner's table answers every cue in every phase, whatever becomes of the shot") {
  check_complete(psc_transitions(), psc_ignored(), psc_phase_count, psc_cue_count);
  check_reachable(psc_transitions(), psc_phase_count);
  check_rows_are_taken<PscContext>(psc_transitions());
  check_names<PscPhase>(psc_phase_count);
  check_names<PscCue>(psc_cue_count);
  check_names<PscAction>(psc_action_count);
}

TEST_CASE("the line robot's table answers every cue in every phase, whatever becomes of the command") {
  check_complete(line_transitions(), line_ignored(), line_phase_count, line_cue_count);
  check_reachable(line_transitions(), line_phase_count);
  check_rows_are_taken<LineContext>(line_transitions());
  check_names<LinePhase>(line_phase_count);
  check_names<LineCue>(line_cue_count);
  check_names<LineAction>(line_action_count);
}

TEST_CASE("a shot whose exposure was reported is exposed again by no order of cues but a new shot") {
  for (const auto& context : all_contexts<PscContext>()) {
    if (!context.outstanding || !context.exposed) continue;
    CHECK_FALSE(
        reachable(psc_transitions(), PscPhase::computing, context, std::set{PscCue::triggered}, psc_cue_count)
            .contains(PscPhase::exposing));
  }
}

TEST_CASE("a latched fault leads back to a motion by no order of cues that lacks a reset") {
  for (const auto& context : all_contexts<LineContext>()) {
    if (!context.latched) continue;
    CHECK(reachable(line_transitions(), LinePhase::faulted, context, std::set{LineCue::reset},
                    line_cue_count) == std::set{LinePhase::offline, LinePhase::faulted});
  }
}

TEST_CASE("from every phase a lost link leads offline") {
  for (int p = 0; p < psc_phase_count; ++p)
    CHECK(find_transition(psc_transitions(), static_cast<PscPhase>(p), PscCue::link_lost, PscContext{})->to ==
          PscPhase::offline);
  for (int p = 0; p < line_phase_count; ++p)
    CHECK(find_transition(line_transitions(), static_cast<LinePhase>(p), LineCue::link_lost, LineContext{})
              ->to == LinePhase::offline);
}
