// How our programs read their arguments. A mistake in them gives one line that says what to do.
//
// Failure      that line on standard error, and the exit code 1
#pragma once

#include <CLI/CLI.hpp>

#include <optional>

namespace moldloft::firmware_like {

// Parses; the program goes on when nothing comes back. Otherwise it ends with this exit code: help or
// version was printed, or the line that says what is wrong. A misspelt command or option is answered with
// the nearest one.
std::optional<int> parse_command_line(CLI::App&, int argc, char** argv);

}  // namespace moldloft::firmware_like
