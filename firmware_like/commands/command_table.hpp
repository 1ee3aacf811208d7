// The commands of the program, one row each: its name, what it is for, and the function that puts its options
// into a command line. Help follows from it, and a test compares manual pages and completion with it.
#pragma once

#include <CLI/CLI.hpp>

#include <functional>
#include <span>

namespace moldloft::firmware_like {

using RunCommand = std::function<int()>;  // with the options as they were parsed; its exit code

struct Command {
  const char* name;
  const char* help;
  RunCommand (*add_options)(CLI::App& to);
};

std::span<const Command> commands();

}  // namespace moldloft::firmware_like
