// What a person reads: lines on standard error, a command's answer on standard output. No reader, present or
// absent, ends the program or holds it up for long: a lost journal, a full disk under the log, a closed
// terminal, a pipe that nobody empties.
//
// Thread       open_console() first of all in main(); say() and unsaid() anywhere but the control thread; the rest on
//              the first thread
// Blocking     say() and show_within() up to their limit; show() as long as its reader takes
// Allocation   none beyond the text that is given
// Failure      say() counts it; show() keeps it for end_of_output()
#pragma once

#include "hal/base/clock.hpp"

#include <cstdint>
#include <string_view>

namespace moldloft::firmware_like {

// Descriptors 0 to 2 are opened on /dev/null where they are closed. Otherwise a run store or a serial port
// would get one of their numbers and be written to like a terminal. A pipe without a reader and a file beyond
// its limit are errors of a write from now on, no longer signals that kill.
void open_console();

// Writes text for a person on standard error, unchanged. Text that cannot be written within a second is
// dropped and counted. From then on nothing waits until somebody reads again.
void say(std::string_view text) noexcept;
std::uint64_t unsaid() noexcept;  // texts that were not, or not wholly, written

// Writes a command's answer on standard output. Nothing is lost silently: end_of_output() reports it.
void show(std::string_view text) noexcept;
void flush_shown() noexcept;  // for who watches while it is written
// The same with a limit, for a program that has to end whether its output is read or not. Returns whether the
// text was written. If not, the caller reports it, and the command has not failed.
bool show_within(hal::Duration limit, std::string_view text) noexcept;

// The exit code of a command that has shown its answer: 1, and a line that says why, when it could not be written.
int end_of_output(int exit_code, std::string_view program) noexcept;

}  // namespace moldloft::firmware_like
