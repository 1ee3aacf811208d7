// A cell's progress as text for people: the line that renews itself on a terminal, the service manager's
// status, what the cell waits for, and its notices. Pure functions.
#pragma once

#include "tasks/progress/cell_progress.hpp"
#include "tasks/progress/notice.hpp"

#include <cstddef>
#include <string>

namespace moldloft::firmware_like {

// What the cell itself does not know about the things that it waits for.
struct Surroundings {
  std::string scanner = "its address", robot = "its port";  // "192.168.10.2:4014", "/dev/ttyS0"
  bool has_operator = false;  // who can send a word: without one none is waited for
};

// "waiting for the robot at /dev/ttyS0"; empty when nothing is.
std::string awaited_text(const tasks::CellProgress&, const Surroundings& = {});

// Time, state and phase, shots, what is left, what is waited for.
std::string progress_line(const tasks::CellProgress&, const Surroundings& = {});
// The same in so many columns at most. First the wording gets shorter, then the least important parts go, at
// last the line is cut, never inside a character.
std::string progress_line_within(std::size_t columns, const tasks::CellProgress&, const Surroundings& = {});

// Without the passing time, and with what a person has to do. It changes only when something happens.
std::string status_line(const tasks::CellProgress&, const Surroundings& = {});

std::string notice_line(const tasks::Notice&);

}  // namespace moldloft::firmware_like
