// How a command ends. A refusal is one line on standard error, and a code that is not zero.
//
// Thread       as say() (console.hpp)
#pragma once

#include "firmware_like/process/journal.hpp"

#include <string_view>

namespace moldloft::firmware_like {

enum ExitCode : int {
  exit_done = 0,
  exit_failed = 1,  // nothing was begun, or a file could not be written
  exit_held = 2,    // the cell holds for a person
  exit_aborted = 3,
  exit_stopped = 4,  // by ctrl-C
  exit_warned = 5,   // measured, with warnings: the audit's findings
  exit_differs = 6,  // inspected, and the plate is outside the limits
};

// Prints a failure as one line; returns its exit code.
int complain(std::string_view what, std::string_view program = "moldloft", Priority = Priority::error);
// The same for several lines, such as all errors of a configuration; each is made printable.
int complain_all(std::string_view lines, std::string_view program = "moldloft");

}  // namespace moldloft::firmware_like
