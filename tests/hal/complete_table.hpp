// A machine's table is complete: every pair of state and event is listed or explicitly ignored, never both,
// every state can be reached, and no event falls through all guards of its rows.
#pragma once

#include <doctest/doctest.h>

#include <cstddef>
#include <set>
#include <utility>

namespace moldloft::hal {

template <typename Table, typename Ignored>
void check_complete(Table table, Ignored ignored, int states, int events) {
  std::set<std::pair<int, int>> listed, left_out;
  for (const auto& row : table) listed.emplace(static_cast<int>(row.from), static_cast<int>(row.on));
  for (const auto& pair : ignored) {
    const bool is_new = left_out.emplace(static_cast<int>(pair.in), static_cast<int>(pair.event)).second;
    CHECK_MESSAGE(is_new, "ignored twice: ", to_string(pair.in), " / ", to_string(pair.event));
  }
  for (int s = 0; s < states; ++s) {
    for (int e = 0; e < events; ++e) {
      const bool in_table = listed.contains({s, e}), in_ignored = left_out.contains({s, e});
      CHECK_MESSAGE(in_table != in_ignored, "state ", s, " event ", e, in_table ? " is both" : " is neither");
    }
  }
}

template <typename Table>
void check_reachable(Table table, int states) {
  std::set<int> reached{0};
  for (std::size_t before = 0; before != reached.size();) {
    before = reached.size();
    for (const auto& row : table) {
      if (reached.contains(static_cast<int>(row.from))) reached.insert(static_cast<int>(row.to));
    }
  }
  CHECK(reached.size() == static_cast<std::size_t>(states));
}

// The last row of each (state, event) must have a guard that always agrees, or an event could fall through unseen.
template <typename Table, typename Context>
void check_no_fall_through(Table table, const Context& exhausted) {
  std::set<std::pair<int, int>> pairs, covered;
  for (const auto& row : table) {
    pairs.emplace(static_cast<int>(row.from), static_cast<int>(row.on));
    if (row.guard.agrees(exhausted)) covered.emplace(static_cast<int>(row.from), static_cast<int>(row.on));
  }
  CHECK(pairs == covered);
}

}  // namespace moldloft::hal
