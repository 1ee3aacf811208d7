// The operator's way to a cell that runs without a terminal: a unix datagram socket. It takes one word a
// datagram and answers with one line. The right to write to the socket's file is the right to command the
// cell (its mode is 0660). A word whose sender has gone away before it could be taken up is not carried out,
// unless it makes the cell safer.
//
//   start hold unhold stop abort clear reset      "done: Held -> Starting", or "refused: ..." and why
//   status                                        one line of JSON
//
// Thread       OperatorThread is an ordinary thread; it reaches the control thread through CellPort only
// Blocking     every wait has a limit
// Failure      one line
#pragma once

#include "firmware_like/gateway/cell_search.hpp"
#include "hal/base/clock.hpp"
#include "tasks/progress/cell_port.hpp"

#include <atomic>
#include <expected>
#include <functional>
#include <string>
#include <string_view>
#include <thread>

namespace moldloft::firmware_like {

// All words that a cell knows, for people: "start, hold, ..., status".
std::string operator_words();

// The answer to a word. `let_time_pass` is called, about ten times at most, while the control loop takes
// up the command.
std::string answer_to(std::string_view word, tasks::CellPort&, const std::function<void()>& let_time_pass);
std::string status_json(const tasks::CellProgress&);

class OperatorSocket {
 public:
  // Replaces a socket that a dead process has left, never that of a living one.
  static std::expected<OperatorSocket, std::string> open(const std::string& path);
  OperatorSocket(OperatorSocket&& other) noexcept;
  OperatorSocket& operator=(OperatorSocket&&) = delete;
  ~OperatorSocket();

  // Waits for a word, at most so long, and sends back the result of `answer`.
  void serve(hal::Duration wait, const std::function<std::string(std::string_view)>& answer) const;

 private:
  OperatorSocket(int file, std::string path) : file_{file}, path_{std::move(path)} {}
  int file_;
  std::string path_;
};

class OperatorThread {
 public:
  OperatorThread(const OperatorSocket&, tasks::CellPort&);
  ~OperatorThread();
  OperatorThread(const OperatorThread&) = delete;
  OperatorThread& operator=(const OperatorThread&) = delete;

 private:
  void work();
  const OperatorSocket& socket_;
  tasks::CellPort& cell_;
  hal::SteadyClock clock_;
  std::atomic<bool> ending_{false};
  std::thread thread_;
};

// Sends a word and waits for the answer, for two seconds at most.
std::expected<std::string, std::string> ask_cell(const std::string& word, const std::string& path);

struct TellOptions {
  std::string word;                  // capitals and blanks around it do not matter to somebody in a hurry
  std::string control;               // the cell's socket; empty: of the only one that runs
  std::string cells = cells_folder;  // where that is looked for
};
int tell_cell(const TellOptions&);  // `moldloft tell`; the program's exit code

}  // namespace moldloft::firmware_like
