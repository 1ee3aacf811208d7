// Progress for a person: one line that renews itself on a terminal, one line a change where the output is a
// file. progress_line() is pure; DisplayThread is the ordinary thread that prints it. A run that ends before
// it has begun to measure leaves nothing behind here: the one line that says why stands alone.
#pragma once

#include <atomic>
#include <string>
#include <thread>

#include "hal/clock.hpp"
#include "tasks/cell.hpp"

namespace moldloft::firmware_like {

std::string progress_line(const tasks::CellProgress&);
// The same without the time that passes, and with what a person has to see to: it changes when something happens.
std::string status_line(const tasks::CellProgress&);

class DisplayThread {
 public:
  // `head` is printed once, when the cell begins to measure or to wait for an operator.
  DisplayThread(const tasks::Cell&, std::string head);
  ~DisplayThread();
  DisplayThread(const DisplayThread&) = delete;
  DisplayThread& operator=(const DisplayThread&) = delete;

 private:
  void work();
  void show(const tasks::CellProgress&);
  const tasks::Cell& cell_;
  hal::SteadyClock clock_;
  bool terminal_, begun_ = false;
  std::string head_;
  std::string last_;
  std::atomic<bool> ending_{false};
  std::thread thread_;
};

}  // namespace moldloft::firmware_like
