// Progress for a person: one line that renews itself on a terminal, one line a change where the output is a file.
// progress_line() is pure; DisplayThread is the ordinary thread that prints it.
#pragma once

#include <atomic>
#include <string>
#include <thread>

#include "hal/clock.hpp"
#include "tasks/cell.hpp"

namespace moldloft::firmware_like {

std::string progress_line(const tasks::CellProgress&);

class DisplayThread {
 public:
  explicit DisplayThread(const tasks::Cell&);
  ~DisplayThread();
  DisplayThread(const DisplayThread&) = delete;
  DisplayThread& operator=(const DisplayThread&) = delete;

 private:
  void work();
  void show(const tasks::CellProgress&);
  const tasks::Cell& cell_;
  hal::SteadyClock clock_;
  bool terminal_;
  std::string last_;
  std::atomic<bool> ending_{false};
  std::thread thread_;
};

}  // namespace moldloft::firmware_like
