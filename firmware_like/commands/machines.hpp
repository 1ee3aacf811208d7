// The state machines of tasks/ as diagrams, drawn from the tables themselves: `moldloft machines`
// prints them, and tasks/README.md holds exactly that (a test compares), so the pictures cannot fall
// behind the code.
//
// Guards are functions without a name at run time. They are told by what they ask for: each is tried with one after
// another of the context's counters not yet used up; a row that always agrees, after others of the same state and
// event, is the `else`.
//
// Blocking     no; allocates. For people, never for the control thread
#pragma once

#include <string>

namespace moldloft::firmware_like {

// Supervisor, shot sequence and tracker as Markdown: a heading and a Mermaid diagram each.
std::string machine_diagrams();

}  // namespace moldloft::firmware_like
