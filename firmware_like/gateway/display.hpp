// Progress for a person. On a terminal one line renews itself and fits the width. In a file, or on a terminal
// that cannot renew a line (TERM=dumb), each change is a line. The ordinary thread that prints
// progress_text.hpp. A run that ends before it has begun to measure leaves nothing behind here: the one line
// that says why stands alone.
#pragma once

#include "firmware_like/gateway/progress_text.hpp"
#include "hal/base/clock.hpp"
#include "tasks/progress/cell_port.hpp"

#include <atomic>
#include <cstddef>
#include <string>
#include <thread>

namespace moldloft::firmware_like {

// Whether the standard error is a terminal that can renew a line.
bool renews_lines(int file, const char* term);
// How many columns a terminal has: its own answer, else COLUMNS, else 80.
std::size_t terminal_columns(int file, const char* columns);

class DisplayThread {
 public:
  // `head` is printed once, when the cell begins to measure or to wait for an operator.
  DisplayThread(const tasks::CellPort&, std::string head, Surroundings);
  ~DisplayThread();
  DisplayThread(const DisplayThread&) = delete;
  DisplayThread& operator=(const DisplayThread&) = delete;

 private:
  void work();
  void show(const tasks::CellProgress&);
  const tasks::CellPort& cell_;
  hal::SteadyClock clock_;
  bool terminal_, begun_ = false;
  std::string head_;
  const Surroundings around_;
  std::string last_;
  std::atomic<bool> ending_{false};
  std::thread thread_;
};

}  // namespace moldloft::firmware_like
