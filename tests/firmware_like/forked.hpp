// Runs a function in a child process and brings its words home: for what changes the process for good (locked
// memory, limits, the user it runs as).
#pragma once

#include <doctest/doctest.h>

#include <functional>
#include <grp.h>
#include <string>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

namespace moldloft::test {

inline bool is_root() { return ::geteuid() == 0; }

// What the child gives up before it begins.
struct Rights {
  bool nobody = false;                   // runs as the user nobody, without capabilities
  rlim_t memlock_bytes = RLIM_INFINITY;  // when smaller than what the parent has
  rlim_t rtprio = 0;
};

inline void give_up(const Rights& rights) {
  if (!rights.nobody) return;
  constexpr unsigned nobody = 65534;
  const rlimit memlock{rights.memlock_bytes, rights.memlock_bytes}, rtprio{rights.rtprio, rights.rtprio};
  if (::setrlimit(RLIMIT_MEMLOCK, &memlock) != 0 || ::setrlimit(RLIMIT_RTPRIO, &rtprio) != 0) ::_exit(90);
  if (::setgroups(0, nullptr) != 0 || ::setgid(nobody) != 0 || ::setuid(nobody) != 0) ::_exit(91);
}

// What `work` returned. A child that ends any other way fails the test.
inline std::string in_child(const Rights& rights, const std::function<std::string()>& work) {
  int ends[2];
  REQUIRE(::pipe(ends) == 0);
  const pid_t child = ::fork();
  REQUIRE(child >= 0);
  if (child == 0) {
    ::close(ends[0]);
    give_up(rights);
    int code = 0;
    try {
      const std::string words = work();
      if (::write(ends[1], words.data(), words.size()) != static_cast<ssize_t>(words.size())) code = 92;
    } catch (const std::exception&) {
      code = 93;
    }
    ::_exit(code);
  }
  ::close(ends[1]);
  std::string words;
  char piece[4096];
  for (ssize_t n = 0; (n = ::read(ends[0], piece, sizeof piece)) > 0;)
    words.append(piece, static_cast<std::size_t>(n));
  ::close(ends[0]);
  int status = 0;
  ::waitpid(child, &status, 0);
  CHECK_MESSAGE((WIFEXITED(status) && WEXITSTATUS(status) == 0), "the child ended with status ", status);
  return words;
}

}  // namespace moldloft::test
