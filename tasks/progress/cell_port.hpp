// What the outside may ask of a running cell, and tell it: plain values and commands. Any gateway that shows
// a cell to others, or passes their commands on, knows this and not the cell.
//
// Thread       progress() and command() from anywhere; next_notice() on one thread
// Blocking     never
// Allocation   none
// Failure      none: a command that means nothing in the cell's state is dropped
#pragma once

#include "tasks/machines/cell_state.hpp"
#include "tasks/progress/cell_progress.hpp"
#include "tasks/progress/notice.hpp"

#include <optional>

namespace moldloft::tasks {

class CellPort {
 public:
  virtual CellProgress progress() const = 0;
  virtual void command(CellEvent) = 0;              // an operator's or line controller's, for the next tick
  virtual std::optional<Notice> next_notice() = 0;  // what has been noted since, in order

 protected:
  ~CellPort() = default;
};

}  // namespace moldloft::tasks
