#include "host_sim/child_process.hpp"

#include <algorithm>
#include <fcntl.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

namespace moldloft::host_sim {

using namespace std::chrono_literals;

ChildProcess::ChildProcess(const std::vector<std::string>& words, const std::string& preload) {
  const std::string out = folder_.file("out"), err = folder_.file("err");
  std::vector<char*> arguments;
  for (const auto& word : words) arguments.push_back(const_cast<char*>(word.c_str()));
  arguments.push_back(nullptr);
  pid_ = ::fork();
  if (pid_ != 0) return;
  if (!preload.empty()) ::setenv("LD_PRELOAD", preload.c_str(), 1);
  ::dup2(::open("/dev/null", O_RDONLY), 0);
  ::dup2(::open(out.c_str(), O_CREAT | O_WRONLY | O_APPEND, 0600), 1);
  ::dup2(::open(err.c_str(), O_CREAT | O_WRONLY | O_APPEND, 0600), 2);
  ::execv(arguments[0], arguments.data());
  ::_exit(127);
}

ChildProcess::~ChildProcess() {
  if (has_ended()) return;
  ::kill(pid_, SIGKILL);
  ::waitpid(pid_, nullptr, 0);
}

bool ChildProcess::has_ended() {
  if (!ended_) ended_ = ::waitpid(pid_, &status_, WNOHANG) == pid_;
  return ended_;
}

void ChildProcess::send(int signal) {
  if (!has_ended()) ::kill(pid_, signal);
}

std::optional<int> ChildProcess::wait(hal::Duration limit) {
  hal::SteadyClock clock;
  while (!has_ended() && clock.now() < limit) clock.sleep_until(clock.now() + 5ms);
  if (!has_ended() || !WIFEXITED(status_)) return std::nullopt;
  return WEXITSTATUS(status_);
}

bool ChildProcess::prints(std::string_view text, hal::Duration limit) {
  hal::SteadyClock clock;
  while (clock.now() < limit) {
    const bool last_look = has_ended();
    if (out().find(text) != std::string::npos || err().find(text) != std::string::npos) return true;
    if (last_look) return false;
    clock.sleep_until(clock.now() + 5ms);
  }
  return false;
}

std::string ChildProcess::out() const { return text_of(folder_.file("out")); }
std::string ChildProcess::err() const { return text_of(folder_.file("err")); }

Finished run_program(const std::vector<std::string>& words, hal::Duration limit) {
  ChildProcess child{words};
  const auto code = child.wait(limit);
  return {code, child.out(), child.err()};
}

int lines_in(std::string_view text) { return static_cast<int>(std::count(text.begin(), text.end(), '\n')); }

}  // namespace moldloft::host_sim
