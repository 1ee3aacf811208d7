// The state machines as diagrams, drawn from the tables themselves: `moldloft machines` prints them.
// tasks/README.md and hal/README.md hold exactly this output (a test compares), so no picture falls
// behind the code.
//
// A guard is shown by its name; a row that always agrees, after others of the same state and event, is the `else`.
//
// Blocking     no; allocates. For people, never for the control thread
#pragma once

#include <string>

namespace moldloft::firmware_like {

// As Markdown, a heading and a Mermaid diagram each.
std::string cell_diagrams();    // supervisor, shot sequence and tracker
std::string driver_diagrams();  // scanner and robot

}  // namespace moldloft::firmware_like
