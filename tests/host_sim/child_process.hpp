// A program under test as a child process: its output is kept in files, its end is waited for with a limit,
// and it never outlives the test.
#pragma once

#include "hal/base/clock.hpp"
#include "hal/file_text.hpp"
#include "hal/temporary_folder.hpp"

#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace moldloft::host_sim {

struct Finished {
  std::optional<int> exit_code;
  std::string out, err;
};

class ChildProcess {
 public:
  // `words`: the program's path and its arguments. `preload`: a library for LD_PRELOAD, or nothing.
  explicit ChildProcess(const std::vector<std::string>& words, const std::string& preload = {});
  ~ChildProcess();
  ChildProcess(const ChildProcess&) = delete;
  ChildProcess& operator=(const ChildProcess&) = delete;

  void send(int signal);
  // The exit code; nothing when the program has not ended within the limit or was ended by a signal.
  std::optional<int> wait(hal::Duration limit);
  // Whether the text appeared in what the program has printed to standard output or to standard error.
  bool prints(std::string_view text, hal::Duration limit);

  std::string out() const;
  std::string err() const;

 private:
  bool has_ended();
  hal::TemporaryFolder folder_;
  int pid_ = -1, status_ = 0;
  bool ended_ = false;
};

// Runs a program to its end.
Finished run_program(const std::vector<std::string>& words, hal::Duration limit = std::chrono::seconds{30});

using hal::text_of;
int lines_in(std::string_view text);

}  // namespace moldloft::host_sim
