// State machines as tables, one row a transition. People read them, and so do the machine, the program
// that draws the diagrams, and a test. The test proves that every pair of state and event is either listed
// or explicitly ignored.
//
// A machine is a pure function of (state, event, context): no clock, no input or output. Rows are tried in order; the
// first whose guard agrees is taken. Guards are pure functions of the context, with the name that people read; the
// action is a value that the owner carries out.
#pragma once

#include "hal/base/realtime.hpp"

#include <span>
#include <string_view>

namespace moldloft::hal {

template <typename Context>
struct Guard {
  std::string_view name;  // what it asks for; empty when it always agrees
  bool (*agrees)(const Context&) MOLDLOFT_NONBLOCKING;
};

template <typename Context>
inline constexpr Guard<Context> always{"", [](const Context&) MOLDLOFT_NONBLOCKING { return true; }};

template <typename State, typename Event, typename Action, typename Context>
struct Transition {
  State from;
  Event on;
  Guard<Context> guard;
  Action action;
  State to;
};

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
    if (row.from == from && row.on == on && row.guard.agrees(context)) return &row;
  }
  return nullptr;
}

}  // namespace moldloft::hal
