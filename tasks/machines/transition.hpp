// State machines as tables: one row a transition, read by people, by the machine, by the test that proves
// that every pair of state and event is either listed or explicitly ignored, and by the program that
// draws the diagrams.
//
// A machine is a pure function of (state, event, context): no clock, no input or output. Rows are tried in order; the
// first whose guard agrees is taken. Guards are free functions on values; the action is a value that the
// owner carries out.
#pragma once

#include "hal/base/realtime.hpp"

#include <span>

namespace moldloft::tasks {

template <typename State, typename Event, typename Action, typename Context>
struct Transition {
  State from;
  Event on;
  bool (*guard)(const Context&) MOLDLOFT_NONBLOCKING;
  Action action;
  State to;
};

template <typename Context>
constexpr bool always(const Context&) MOLDLOFT_NONBLOCKING {
  return true;
}

template <typename State, typename Event>
struct Ignored {  // this event means nothing in this state, and that is intended
  State in;
  Event event;
};

template <typename State, typename Event, typename Action, typename Context>
const Transition<State, Event, Action, Context>* find_transition(
    std::span<const Transition<State, Event, Action, Context>> table, State from, Event on,
    const Context& context) MOLDLOFT_NONBLOCKING {
  for (const auto& row : table) {
    if (row.from == from && row.on == on && row.guard(context)) return &row;
  }
  return nullptr;
}

}  // namespace moldloft::tasks
